"use strict";
(() => {
  const { at, fixed, cable, colour, config, axis, layout, rows, warn } = Page;
  const clock = (seconds) => (seconds === null ? "–" : `${Math.floor(seconds / 60)}:${String(Math.floor(seconds % 60)).padStart(2, "0")}`);

  let hello = null, waiting = [], due = false, bars = [], estimates = [], last = null, ended = false;

  function started(message) {
    hello = message;
    waiting = [];
    estimates = [];
    document.body.className = "";
    document.title = `${message.title}: ${message.replay ? "replay" : "live"}`;
    at("title").textContent = [message.replay ? "replay" : "live", message.robot, message.title].filter(Boolean).join(" · ");
    at("stop").hidden = !message.may_stop;
    at("warning").hidden = true;
    at("estimate").hidden = true;
    at("told").hidden = true;
    at("no-estimate").hidden = false;
    at("no-estimate").textContent = message.replay
      ? "No estimate so far in the log."
      : "No estimate yet: one is made after every rest, or on the way.";
    const limits = message.limits_N;
    at("tension-note").textContent = limits
      ? `Bar: load cell; upright mark: set-point; dashed: limits of ${limits[0]} and ${limits[1]} N.`
      : "Bar: load cell; upright mark: set-point. The limits are in the robot file: name it with --robot.";
    const place = at("tensions");
    place.replaceChildren();
    bars = [];
    for (let i = 0; i < message.cables; i++) {
      const row = document.createElement("div");
      row.className = "cable";
      const part = (name, parent = row) => parent.appendChild(Object.assign(document.createElement(name === "track" || name.startsWith("t-") ? "div" : "span"), { className: name.replace("t-", "") }));
      part("name").textContent = `cable ${i + 1}`;
      const track = part("track");
      const fill = part("t-fill", track);
      fill.style.background = `var(--c${(i % 8) + 1})`;
      const mark = part("t-mark", track);
      const lines = limits ? limits.map(() => part("t-limit", track)) : [];
      bars.push({ row, fill, mark, lines, value: part("value"), wanted: part("wanted") });
      place.append(row);
    }
    const line = (i, wanted) => ({
      x: [], y: [], mode: "lines", name: wanted ? "set-points" : `cable ${i + 1}`, legendgroup: wanted ? "set-points" : `cable ${i + 1}`, showlegend: !wanted || i === 0,
      line: wanted ? { width: 0.9, dash: "dot" } : { width: 1.4 },
    });
    const cables = [...Array(message.cables).keys()];
    Plotly.newPlot("plot", [...cables.map((i) => line(i, false)), ...cables.map((i) => line(i, true))], overTime(), config);
    Plotly.restyle("plot", { "line.color": lineColours() });
  }

  const overTime = () => layout(320, { xaxis: axis("time [s]"), yaxis: axis("tension [N]", { rangemode: "tozero" }) });
  const lineColours = () => [...Array(2 * hello.cables).keys()].map((i) => (i < hello.cables ? cable(i) : colour("ink")));

  // The axis of the bars: to the upper limit where tensions come near it, else to what was seen.
  function top() {
    const seen = 1.25 * Math.max(10, ...last.tension_N.filter((v) => v !== null), ...last.setpoint_N.filter((v) => v !== null), top.most || 0);
    top.most = Math.max(top.most || 0, seen / 1.25);
    return seen;
  }

  function draw() {
    due = false;
    if (!last) return;
    if (!ended) at("does").textContent = last.does || (hello.replay ? "replay" : "running");
    at("time").textContent = `${fixed(last.time_s, 1)} s`;
    at("left").textContent = clock(last.remaining_s);
    at("ripple").textContent = last.ripple === null ? "–" : `${Math.round(100 * last.ripple)} %`;
    at("done").textContent = hello.setpoints ? `${last.done} of ${hello.setpoints}` : `${last.done}`;
    at("bar").max = hello.setpoints || 1;
    at("bar").value = hello.setpoints ? last.done : 0;
    at("bar").hidden = !hello.setpoints;
    if (last.place) {
      at("where").hidden = false;
      at("place").textContent = `${last.place.position_m.map((value) => fixed(value, 3)).join("  ")} m`;
      at("place-sigma").textContent = `± ${last.place.position_sigma_m.map((value) => (1e3 * value).toPrecision(2)).join("  ")} mm (1 σ)`;
    } else if (!at("where").hidden) {
      at("place").textContent = "not known";
      at("place-sigma").textContent = "";
    }
    const most = top();
    const percent = (value) => `${Math.min(100, Math.max(0, (100 * value) / most))}%`;
    bars.forEach((bar, i) => {
      const value = last.tension_N[i] ?? null, wanted = last.setpoint_N[i] ?? null;
      bar.fill.style.width = value === null ? "0" : percent(value);
      bar.mark.hidden = wanted === null;
      bar.mark.style.left = percent(wanted ?? 0);
      bar.value.textContent = `${fixed(value, 1)} N`;
      bar.wanted.textContent = wanted === null ? "" : `set-point ${fixed(wanted, 1)} N`;
      bar.lines.forEach((line, k) => { line.hidden = hello.limits_N[k] > most; line.style.left = percent(hello.limits_N[k]); });
      bar.row.classList.toggle("outside", !!hello.limits_N && value !== null && (value < hello.limits_N[0] || value > hello.limits_N[1]));
    });
    if (waiting.length) {
      const x = waiting.map((s) => s.time_s);
      const columns = [...Array(hello.cables).keys()];
      const ys = [...columns.map((i) => waiting.map((s) => s.tension_N[i] ?? null)), ...columns.map((i) => waiting.map((s) => s.setpoint_N[i] ?? null))];
      waiting = [];
      Plotly.extendTraces("plot", { x: ys.map(() => x), y: ys }, ys.map((_, i) => i), 20000);
    }
  }

  function soon() {
    if (!due) { due = true; setTimeout(draw, 250); }
  }

  function estimated(message) {
    estimates.push(message);
    at("estimate").hidden = false;
    at("no-estimate").hidden = true;
    const degree = 180 / Math.PI;
    const known = message.pose && message.position_sigma_m !== null && message.trusted;
    const of = message.in_motion ? "set-point" : "rest";
    const after = `After ${message.rests} ${of}${message.rests === 1 ? "" : "s"}`;
    at("known").textContent = known
      ? `${after}: ± ${(1e3 * message.position_sigma_m).toPrecision(2)} mm and ± ${(degree * message.rotation_sigma_rad).toPrecision(2)}° (1 σ, worst axis)${message.reached ? ": as well as was asked for" : ""}.`
      : `${after}: ${message.status === "converged" ? "not to be trusted" : message.status.replaceAll("_", " ")}.`;
    const pose = [];
    if (known) {
      ["x", "y", "z"].forEach((name, i) => pose.push([name, `${fixed(message.pose.position_m[i], 4)} m`]));
      ["roll", "pitch", "yaw"].forEach((name, i) => pose.push([name, `${fixed(degree * message.pose.roll_pitch_yaw_rad[i], 3)}°`]));
    }
    rows(at("pose"), pose);
    drawShrink();
    if (message.diagnosis) drawEvidence(after, message.diagnosis);
  }

  // Evidence grows rest by rest; an effect that is no longer named ends.
  function drawEvidence(after, told) {
    at("told").hidden = false;
    const said = told.effects.map((e) => `${e.name} (${e.log_evidence.toFixed(0)} nats${e.rivals.length ? `, or ${e.rivals.join(", ")}` : ""})`);
    at("says").textContent = `${after}: ${told.verdict}${[...told.faults, ...said].map((text, i) => `${i ? "; " : ": "}${text}`).join("")}.`;
    const diagnosed = estimates.filter((e) => e.diagnosis);
    const names = [...new Set(diagnosed.flatMap((e) => e.diagnosis.effects.map((effect) => effect.name)))];
    const evidence = (e, name) => e.diagnosis.effects.find((effect) => effect.name === name)?.log_evidence ?? null;
    Plotly.react("evidence", names.map((name, i) => ({
      x: diagnosed.map((e) => e.time_s), y: diagnosed.map((e) => evidence(e, name)),
      name, mode: "lines+markers", line: { color: cable(i) }, marker: { size: 7 },
    })), layout(300, { xaxis: axis("time [s]"), yaxis: axis("evidence [nats]", { rangemode: "tozero" }), showlegend: true }), config);
  }

  function drawShrink() {
    const degree = 180 / Math.PI;
    const trace = (name, key, factor, unit, axis, colour, symbol) => ({
      x: estimates.map((e) => e.time_s), y: estimates.map((e) => (e[key] === null || !e.trusted ? null : factor * e[key])),
      name: `${name} [${unit}]`, mode: "lines+markers", yaxis: axis, line: { color: colour }, marker: { symbol, size: 7 },
    });
    Plotly.react("shrink", [trace("position", "position_sigma_m", 1e3, "mm", "y", cable(0), "circle"), trace("rotation", "rotation_sigma_rad", degree, "°", "y2", cable(1), "diamond")], layout(300, {
      xaxis: axis("time [s]"),
      yaxis: axis("σ of the position [mm]", { type: "log", nticks: 5 }),
      yaxis2: axis("σ of the rotation [°]", { type: "log", overlaying: "y", side: "right", showgrid: false, tickformat: ".2~g", nticks: 5 }),
    }), config);
  }

  Page.onScheme(() => {
    if (!hello) return;
    Plotly.update("plot", { "line.color": lineColours() }, overTime());
    if (!estimates.length) return;
    drawShrink();
    const told = estimates.findLast((e) => e.diagnosis);
    if (told) drawEvidence(`After ${told.rests} rests`, told.diagnosis);
  });

  const source = new EventSource("/events");
  source.onmessage = (event) => {
    const message = JSON.parse(event.data);
    if (message.type === "hello") started(message);
    else if (message.type === "sample") { last = message; waiting.push(message); soon(); }
    else if (message.type === "estimate") estimated(message);
    else if (message.type === "end") {
      source.close();
      draw();
      ended = true;
      const well = message.state === "done" && !message.reason;
      document.body.className = well ? "done" : "stopped";
      at("does").textContent = hello.replay ? "end of the log" : well ? "done, winches locked" : "stopped, winches locked";
      if (message.reason) warn(message.reason);
      at("no-estimate").textContent = hello.replay ? "The log holds no estimate: cdprcal calibrate makes one of it." : "No estimate was made.";
      at("stop").disabled = true;
      document.documentElement.dataset.live = "ended";
    }
  };
  source.onerror = () => warn("The connection is lost: what is shown is old. The robot does not depend on this page.");
  source.onopen = () => warn("");

  at("stop").addEventListener("click", async () => {
    at("stop").disabled = true;
    try {
      await Page.ask("/stop");
    } catch (error) {
      at("stop").disabled = false;
      warn(`The stop was not received (${error.message}): use the emergency stop.`);
    }
  });
})();
