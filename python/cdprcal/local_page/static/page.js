"use strict";
// What all local pages share: elements, numbers, asking the server, plots in the colours of the style sheet.
const Page = (() => {
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  const at = (id) => document.getElementById(id);
  const fixed = (value, digits) => (value === null || value === undefined ? "–" : value.toFixed(digits).replace("-", "\u2212"));
  const cable = (i) => colour(`c${(i % 8) + 1}`);
  const config = { responsive: true, displayModeBar: false };

  const axis = (title, more = {}) => ({
    gridcolor: colour("grid"), zeroline: false, linecolor: colour("muted"), ticks: "outside", ticklen: 4, tickcolor: colour("muted"),
    automargin: true, title: { text: title, standoff: 8 }, ...more,
  });
  const layout = (height, more = {}) => ({
    height, margin: { l: 56, r: 14, t: 24, b: 44 }, paper_bgcolor: colour("paper"), plot_bgcolor: colour("paper"), hovermode: "closest",
    font: { family: "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, sans-serif", size: 12, color: colour("ink") },
    legend: { orientation: "h", x: 0, y: 1, yanchor: "bottom" }, ...more,
  });
  // Plots have their colours in themselves: whoever draws them draws them again.
  const onScheme = (draw) => matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);

  function rows(place, lines) {
    place.replaceChildren(...lines.map((texts) => {
      const line = document.createElement("tr");
      texts.forEach((text, i) => {
        const cell = document.createElement(i ? "td" : "th");
        if (!i) cell.scope = "row";
        cell.textContent = text;
        line.append(cell);
      });
      return line;
    }));
  }

  function warn(text) {
    at("warning").textContent = text;
    at("warning").hidden = !text;
  }

  // The answer of an action as data, null if it has none; what the server objects to is thrown.
  async function ask(path, body = null) {
    const token = document.querySelector('meta[name="token"]').content;
    const answer = await fetch(path, { method: "POST", headers: { "X-Token": token }, body: body === null ? undefined : JSON.stringify(body) });
    if (answer.status === 204) return null;
    const type = answer.headers.get("Content-Type") || "";
    const data = type.startsWith("application/json") ? await answer.json() : null;
    if (!answer.ok) throw new Error(data ? data.error : `${answer.status}`);
    return data;
  }

  return { at, fixed, cable, colour, config, axis, layout, onScheme, rows, warn, ask };
})();
