"use strict";
(() => {
  const { at, fixed, colour, cable, config, axis, layout, rows, warn, ask } = Page;
  const page = document.documentElement;
  // What is asked for: null lets the diagnosis search; then the names that are ticked, in their order.
  let effects = [], leftOut = [], shown = null;
  // Of several questions under way only the last counts.
  let asked = 0, fitting = false;

  const choice = () => ({ effects, left_out: leftOut });
  const nats = (value) => (value === null ? "–" : `${value > 0 ? "+" : ""}${fixed(value, 1)} nat`);
  const element = (name, more = {}, parent = null) => {
    const made = Object.assign(document.createElement(name), more);
    if (parent) parent.append(made);
    return made;
  };

  async function answer(mine) {
    const before = shown;
    try {
      const found = await ask("/fit", choice());
      if (mine !== asked) return;
      shown = found;
      draw(before);
      warn("");
      page.dataset.explore = "ready";
    } catch (error) {
      if (mine !== asked) return;
      warn(error.message);
      page.dataset.explore = "failed";
    }
  }

  // Chosen effects are fitted one choice after the other. A search takes longer: whatever is asked for next ends it.
  async function fit() {
    const mine = ++asked;
    page.dataset.explore = "busy";
    if (effects === null) return search(mine);
    if (fitting) return;
    fitting = true;
    let last;
    do {
      last = asked;
      await answer(last);
    } while (last !== asked && effects !== null);
    fitting = false;
  }

  async function search(mine) {
    at("said").textContent = "looking for effects …";
    at("said").classList.remove("long");
    const tell = async () => {
      const { step } = await ask("/step", null);
      if (mine === asked && page.dataset.explore === "busy") at("said").textContent = `looking for effects … ${step}`;
    };
    const telling = setInterval(() => tell().catch(() => {}), 400);
    await answer(mine);
    clearInterval(telling);
  }

  // The model as it was given is there at once; what the diagnosis finds follows.
  async function open() {
    await fit();
    if (asked !== 1 || page.dataset.explore !== "ready") return;
    effects = null;
    fit();
  }

  function draw(before) {
    at("title").textContent = ["explore", shown.robot, ...shown.logs].join(" · ");
    document.title = `${shown.logs.join(", ")}: explore`;
    const inside = shown.effects.filter((e) => e.on);
    const gained = before ? shown.evidence - before.evidence : null;
    at("said").textContent = shown.searched ? shown.said
      : `${inside.length} ${inside.length === 1 ? "effect" : "effects"}, evidence ${nats(shown.evidence)}${gained === null || before.poses !== leftOut.length ? "" : ` (${nats(gained)})`}`;
    at("said").classList.toggle("long", at("said").textContent.length > 60);
    shown.poses = leftOut.length;
    // From here on the page holds the choice: what was found is what is ticked.
    if (effects === null) effects = inside.map((e) => e.name);
    at("faults").replaceChildren(...[...shown.faults.map((text) => `set right: ${text}`), ...shown.notes].map((text) => element("li", { textContent: text })));
    drawEffects();
    rows(at("rms"), shown.rms.map((r) => [r.channel, r.given, r.now, r.held_out, r.ripple]));
    rows(at("pose"), shown.pose.map(([name, given, sGiven, now, sNow, , unit]) => [name, given, sGiven, now, sNow, unit]));
    drawLeftOut();
    drawPlots();
  }

  function drawEffects() {
    const focused = document.activeElement && document.activeElement.dataset ? document.activeElement.dataset.effect : undefined;
    at("effects").replaceChildren(...shown.effects.map((effect) => {
      const row = element("div", { className: effect.on ? "effect on" : "effect" });
      const label = element("label", { title: effect.sentence }, row);
      const box = element("input", { type: "checkbox", checked: effect.on }, label);
      box.dataset.effect = effect.name;
      box.addEventListener("change", () => {
        const ticked = effects ?? shown.effects.filter((e) => e.on).map((e) => e.name);
        effects = box.checked ? [...ticked, effect.name] : ticked.filter((name) => name !== effect.name);
        fit();
      });
      element("span", { textContent: effect.name }, label);
      element("span", { className: "evidence", textContent: nats(effect.evidence) }, label);
      if (effect.values.length) {
        const body = element("tbody", {}, element("table", {}, row));
        rows(body, effect.values.map(([where, value, deviation, unit]) => [where, `${value} ± ${deviation} ${unit}`]));
      }
      if (effect.rivals.length) element("p", { className: "note", textContent: `cannot be told from ${effect.rivals.join(", ")}` }, row);
      return row;
    }));
    if (focused) at("effects").querySelector(`[data-effect="${focused}"]`)?.focus();
  }

  const nameOf = (run) => (shown.logs.length > 1 ? `log ${run + 1}, ` : "");

  function drawLeftOut() {
    at("left-out").replaceChildren(...leftOut.map((pose) => {
      const [run, time] = pose;
      const button = element("button", { type: "button", textContent: `${nameOf(run)}${fixed(time, 1)} s left out: take it back` });
      button.dataset.pose = `${run} ${time}`;
      button.addEventListener("click", () => { leftOut = leftOut.filter((p) => p !== pose); fit(); });
      return button;
    }));
    const symbols = shown.logs.length > 1 ? ` ${shown.logs.map((name, i) => `${["●", "◆"][i % 2]} ${name}`).join(", ")}.` : "";
    at("legend").textContent = `Modelled minus read. Full: now; hollow: as given; band: the readings' own ripple.${symbols} Click a point to leave its pose out.`;
  }

  function drawPlots() {
    const place = at("plots");
    while (place.children.length > shown.channels.length) place.lastChild.remove();
    while (place.children.length < shown.channels.length) element("div", { className: "plot" }, place);
    const parts = (channel) => (channel ? [...new Set(channel.series.map((s) => s.part))].join() : "");
    shown.channels.forEach((channel, k) => {
      const plot = place.children[k];
      // Colours are told once, and again where they are of something else.
      const legend = parts(channel) !== parts(shown.channels[k - 1]), last = k === shown.channels.length - 1;
      plot.setAttribute("role", "img");
      plot.setAttribute("aria-label", `Residuals of ${channel.quantity} over the run; their root mean square is in the table above`);
      const traces = channel.series.map((s) => ({
        x: s.x, y: s.y, mode: "markers", name: s.part, legendgroup: s.part, showlegend: legend && s.now && s.log === 0, customdata: s.x.map((time) => [s.log, time]),
        hovertemplate: `${s.part}, ${nameOf(s.log)}%{x:.1f} s: %{y:.3g}<extra>${s.now ? "now" : "as given"}</extra>`, opacity: s.now ? 1 : 0.55,
        marker: { color: cable(s.colour), size: s.now ? 8 : 7, symbol: `${["circle", "diamond"][s.log % 2]}${s.now ? "" : "-open"}` },
      }));
      const limit = 1.12 * channel.largest || 1;
      const band = channel.ripple ? [{ type: "rect", xref: "paper", x0: 0, x1: 1, y0: -channel.ripple, y1: channel.ripple, fillcolor: colour("band"), line: { width: 0 }, layer: "below" }] : [];
      Plotly.react(plot, traces, layout(150 + (legend ? 40 : 0) + (last ? 24 : 0), {
        margin: { l: 64, r: 14, t: legend ? 46 : 6, b: last ? 44 : 20 }, shapes: band,
        xaxis: axis(last ? "time in the run [s]" : ""), yaxis: axis(channel.quantity, { automargin: false, range: [-limit, limit], zeroline: true, zerolinecolor: colour("muted") }),
      }), config).then(() => {
        plot.removeAllListeners("plotly_click");
        plot.on("plotly_click", (event) => leaveOut(event.points[0].customdata));
      });
    });
  }

  function leaveOut([run, time]) {
    if (leftOut.some((pose) => pose[0] === run && pose[1] === time)) return;
    const kept = leftOut;
    leftOut = [...leftOut, [run, time]];
    fit().then(() => {
      if (page.dataset.explore !== "failed") return;
      leftOut = kept; // it cannot be left out: the page says why
      page.dataset.explore = "ready";
    });
  }

  at("find").addEventListener("click", () => { effects = null; fit(); });
  at("none").addEventListener("click", () => { effects = []; fit(); });
  at("save").addEventListener("click", async () => {
    at("save").disabled = true;
    try {
      const saved = await ask("/save", choice());
      if (saved.text !== undefined) {
        const link = element("a", { href: URL.createObjectURL(new Blob([saved.text], { type: "application/yaml" })), download: saved.name });
        link.click();
        URL.revokeObjectURL(link.href);
      }
      at("done").textContent = saved.saved ? `Saved: ${saved.saved}` : `Downloaded: ${saved.name}`;
      at("done").hidden = false;
    } catch (error) {
      warn(error.message);
    }
    at("save").disabled = false;
  });
  Page.onScheme(() => { if (shown) drawPlots(); });
  open();
})();
