"use strict";
(async () => {
  const page = document.documentElement;
  const read = (id) => JSON.parse(document.getElementById(id).textContent);
  const figures = read("figures"), night = read("night");
  const scenes = {};
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const narrow = window.matchMedia("(max-width: 760px)");
  const config = { displaylogo: false, responsive: true, displayModeBar: false, scrollZoom: false };

  const save = document.getElementById("save-numbers");
  save.hidden = false;
  save.addEventListener("click", () => {
    const blob = new Blob([document.getElementById("numbers").textContent], { type: "application/json" });
    const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: "numbers.json" });
    link.click();
    URL.revokeObjectURL(link.href);
  });

  // Paper cannot be clicked: everything that is folded is unfolded on it.
  window.addEventListener("beforeprint", () => {
    for (const details of document.querySelectorAll("details")) details.open = true;
  });

  function failed(why) {
    for (const id of Object.keys(figures)) {
      const place = document.getElementById(id);
      if (place && !place.dataset.drawn) place.textContent = `This figure could not be drawn: ${why} All numbers are in the tables.`;
    }
    page.dataset.report = "failed";
  }

  try {
    await unpackPlotly();
  } catch (error) {
    failed(`${error.message}.`);
    return;
  }

  async function unpackPlotly() {
    if (!("DecompressionStream" in window)) throw new Error("this browser is older than 2023");
    const packed = Uint8Array.from(atob(document.getElementById("plotly").textContent), (c) => c.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    const script = document.createElement("script");
    script.textContent = await new Response(stream).text();
    document.head.append(script);
    if (!window.Plotly) throw new Error("plotly did not start");
  }

  // What plotly may change: a copy of a figure, in the colours of the page.
  function copy(value, colours) {
    if (typeof value === "string") return (colours && colours[value]) || value;
    if (Array.isArray(value)) return value.map((v) => copy(v, colours));
    if (value && typeof value === "object") return Object.fromEntries(Object.entries(value).map(([k, v]) => [k, copy(v, colours)]));
    return value;
  }

  async function draw(id) {
    const { data, layout } = copy({ data: figures[id].data, layout: figures[id].layout }, dark.matches ? night : null);
    if (figures[id].moving && narrow.matches) layout.height = 460;
    const place = document.getElementById(id);
    await Plotly.react(place, data, layout, config);
    if (figures[id].moving) await Plotly.relayout(place, { "scene.camera": fitted(id, layout.scene.camera.eye) });
  }

  // The camera in a direction, as far away as shows the whole box: plotly sees 45° from top to bottom.
  function fitted(id, eye) {
    const { camera, aspectratio } = figures[id].layout.scene;
    const { w, h } = document.getElementById(id)._fullLayout._size;
    const margin = 36; // [px], for the words beside the axes
    const slope = { up: Math.tan(Math.PI / 8) * (1 - 2 * margin / h), side: Math.tan(Math.PI / 8) * (w - 2 * margin) / h };
    const length = Math.hypot(eye.x, eye.y, eye.z), flat = Math.hypot(eye.x, eye.y);
    const back = [eye.x, eye.y, eye.z].map((v) => v / length);
    const side = [-eye.y / flat, eye.x / flat, 0];
    const up = [-back[2] * side[1], back[2] * side[0], back[0] * side[1] - back[1] * side[0]];
    const along = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let distance = 0;
    for (let corner = 0; corner < 8; ++corner) {
      const point = ["x", "y", "z"].map((a, k) => (corner >> k & 1 ? 0.5 : -0.5) * aspectratio[a]);
      const across = Math.max(Math.abs(along(point, up)) / slope.up, Math.abs(along(point, side)) / slope.side);
      distance = Math.max(distance, along(point, back) + across);
    }
    return { ...camera, eye: { x: distance * back[0], y: distance * back[1], z: distance * back[2] } };
  }

  const canTurn = (() => {
    try { return !!document.createElement("canvas").getContext("webgl"); } catch { return false; }
  })();

  // A picture of each figure for paper: a browser prints what is on the page, and no WebGL.
  async function picture(id) {
    const place = document.getElementById(id);
    const flat = !(id in scenes);
    const width = 1000, { data, layout } = copy({ data: figures[id].data, layout: figures[id].layout });
    if (!flat) {
      moved(id, scenes[id].number).forEach((line, i) => ["x", "y", "z"].forEach((axis, k) => { data[figures[id].moving.traces[i]][axis] = line[k]; }));
      layout.scene.camera = structuredClone(place._fullLayout.scene.camera);
    }
    const url = await Plotly.toImage({ data, layout }, { format: flat ? "svg" : "png", width, height: layout.height, scale: flat ? 1 : 2 });
    let image = place.parentElement.querySelector("img.print");
    if (!image) {
      image = Object.assign(document.createElement("img"), { className: "print", alt: place.getAttribute("aria-label") });
      place.after(image);
      place.parentElement.classList.add("drawn");
    }
    image.src = url;
  }

  function moved(id, number) {
    const pose = figures[id].moving.poses[number];
    return [...pose.cables, pose.pulleys, pose.edges, pose.centre];
  }

  function show(id, number) {
    const { traces, labels } = figures[id].moving;
    const lines = moved(id, number);
    scenes[id].number = number;
    const column = (i) => lines.map((line) => line[i]);
    Plotly.restyle(id, { x: column(0), y: column(1), z: column(2) }, traces);
    const controls = document.querySelector(`[data-scene="${id}"]`);
    controls.querySelector("output").textContent = labels[number];
    controls.querySelector("input").setAttribute("aria-valuetext", labels[number]);
  }

  function turn(id, view) {
    const now = document.getElementById(id)._fullLayout.scene.camera;
    const { x, y, z } = now.eye;
    const zoom = (factor) => ({ ...now, eye: { x: factor * x, y: factor * y, z: factor * z } });
    const spin = (angle) => ({ ...now, eye: { x: x * Math.cos(angle) - y * Math.sin(angle), y: x * Math.sin(angle) + y * Math.cos(angle), z } });
    const cameras = {
      home: () => fitted(id, figures[id].layout.scene.camera.eye),
      top: () => fitted(id, { x: 0, y: -0.01, z: 2 }),
      front: () => fitted(id, { x: 0, y: -2, z: 0 }),
      left: () => spin(-Math.PI / 12),
      right: () => spin(Math.PI / 12),
      in: () => zoom(1 / 1.2),
      out: () => zoom(1.2),
    };
    Plotly.relayout(id, { "scene.camera": structuredClone(cameras[view]()) });
  }

  const problems = [];
  for (const [id, figure] of Object.entries(figures)) {
    const place = document.getElementById(id);
    if (!place) continue;
    place.textContent = "";
    if (figure.moving && !canTurn) continue; // its still picture is there
    try {
      place.dataset.drawn = "true"; // shown first: it is drawn as large as its place
      await draw(id);
    } catch (error) {
      delete place.dataset.drawn;
      place.textContent = `This figure could not be drawn: ${error.message}`;
      problems.push(`${id}: ${error.message}`);
      continue;
    }
    if (!figure.moving) continue;
    scenes[id] = { number: 0 };
    const controls = document.querySelector(`[data-scene="${id}"]`);
    const slider = controls.querySelector("input");
    controls.querySelector("output").textContent = figure.moving.labels[0];
    let later;
    const again = () => { clearTimeout(later); later = setTimeout(() => picture(id), 800); };
    slider.addEventListener("input", () => { show(id, Number(slider.value)); again(); });
    for (const button of controls.querySelectorAll("[data-view]"))
      button.addEventListener("click", () => { turn(id, button.dataset.view); again(); });
    place.on("plotly_relayout", again);
  }
  dark.addEventListener("change", async () => {
    for (const place of document.querySelectorAll("[data-drawn]")) {
      await draw(place.id);
      if (place.id in scenes) show(place.id, scenes[place.id].number);
    }
  });
  for (const { id } of document.querySelectorAll("[data-drawn]")) {
    try {
      await picture(id);
    } catch (error) {
      problems.push(`${id} for paper: ${error.message}`);
    }
  }
  for (const problem of problems) console.error(problem);
  page.dataset.report = problems.length ? "failed" : "drawn";
})();
