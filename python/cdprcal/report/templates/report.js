"use strict";
(async () => {
  const page = document.documentElement;
  const read = (id) => JSON.parse(document.getElementById(id).textContent);
  const figures = read("figures");
  const scenes = {};
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

  // A picture of each figure for paper: a browser prints what is on the page, and no WebGL.
  async function picture(id) {
    const place = document.getElementById(id);
    const flat = !(id in scenes);
    const width = 1000, height = figures[id].layout.height;
    const url = await Plotly.toImage(place, { format: flat ? "svg" : "png", width, height, scale: flat ? 1 : 2 });
    let image = place.parentElement.querySelector("img.print");
    if (!image) {
      image = Object.assign(document.createElement("img"), { className: "print", alt: place.getAttribute("aria-label") });
      place.after(image);
      place.parentElement.classList.add("drawn");
    }
    image.src = url;
  }

  function show(id, number) {
    const { traces, poses, labels } = figures[id].moving;
    const pose = poses[number];
    const lines = [...pose.cables, pose.pulleys, pose.edges, pose.centre];
    const column = (i) => lines.map((line) => line[i]);
    Plotly.restyle(id, { x: column(0), y: column(1), z: column(2) }, traces);
    const controls = document.querySelector(`[data-scene="${id}"]`);
    controls.querySelector("output").textContent = labels[number];
    controls.querySelector("input").setAttribute("aria-valuetext", labels[number]);
  }

  function turn(id, view) {
    const home = figures[id].layout.scene.camera;
    const now = document.getElementById(id)._fullLayout.scene.camera;
    const { x, y, z } = now.eye;
    const zoom = (factor) => ({ ...now, eye: { x: factor * x, y: factor * y, z: factor * z } });
    const spin = (angle) => ({ ...now, eye: { x: x * Math.cos(angle) - y * Math.sin(angle), y: x * Math.sin(angle) + y * Math.cos(angle), z } });
    const cameras = {
      home: () => home,
      top: () => ({ ...home, eye: { x: 0, y: -0.01, z: 2 } }),
      front: () => ({ ...home, eye: { x: 0, y: -2, z: 0 } }),
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
    try {
      // Drawing changes what it is given; the original is still needed.
      await Plotly.newPlot(place, structuredClone(figure.data), structuredClone(figure.layout), config);
      place.dataset.drawn = "true";
    } catch (error) {
      place.textContent = `This figure could not be drawn: ${error.message}`;
      problems.push(`${id}: ${error.message}`);
      continue;
    }
    if (!figure.moving) continue;
    scenes[id] = true;
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
  for (const id of Object.keys(figures)) {
    try {
      await picture(id);
    } catch (error) {
      problems.push(`${id} for paper: ${error.message}`);
    }
  }
  for (const problem of problems) console.error(problem);
  page.dataset.report = problems.length ? "failed" : "drawn";
})();
