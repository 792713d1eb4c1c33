"use strict";
// The search of a site that is opened from the disk. There browsers start no worker, and this one of the same name is a
// frame: the worker's script runs in it, and what either posts is an event of the other. MkDocs' theme asks for IFrameWorker.
if (location.protocol === "file:") {
  window.IFrameWorker = class extends EventTarget {
    constructor(address) {
      super();
      const frame = document.createElement("iframe");
      frame.hidden = true;
      document.body.append(frame);
      const inside = frame.contentWindow;
      const script = inside.document.createElement("script");
      inside.postMessage = (data) => {
        const event = new MessageEvent("message", { data });
        this.dispatchEvent(event);
        if (this.onmessage) this.onmessage(event);
      };
      inside.importScripts = (...names) => Promise.all(names.map((name) => new Promise((done, failed) => {
        inside.document.head.append(Object.assign(inside.document.createElement("script"), { src: name, onload: done, onerror: failed }));
      })));
      this.ready = new Promise((done) => { script.onload = done; });
      this.frame = frame;
      script.src = new URL(address, document.baseURI).href;
      inside.document.body.append(script);
    }
    postMessage(data) {
      this.ready.then(() => {
        const { contentWindow: inside } = this.frame;
        const event = new inside.MessageEvent("message", { data });
        inside.dispatchEvent(event);
        if (inside.onmessage) inside.onmessage(event);
      });
    }
    terminate() { this.frame.remove(); }
  };
  window.Worker = window.IFrameWorker;
}
