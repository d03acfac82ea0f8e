// Draws the figures of the page with plotly: in the light or dark scheme of the reader, with as many panels
// next to each other as the window has room for, and for printing with the width of the paper.
(() => {
  const figures = JSON.parse(document.getElementById("figures").textContent);
  const places = [...document.querySelectorAll(".plot")];
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const PAPER = 700;
  let printing = false;
  const config = {
    displaylogo: false,
    displayModeBar: true,
    modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"],
    toImageButtonOptions: { format: "svg" },
  };

  // Returns the number of powers of ten that the values of a panel span.
  function decades(spec, panel, axis = "y") {
    const logs = spec.traces.filter((t) => t.panel === panel).flatMap((t) => t[axis]).filter((v) => v > 0).map(Math.log10);
    return logs.reduce((a, b) => Math.max(a, b), -Infinity) - logs.reduce((a, b) => Math.min(a, b), Infinity);
  }

  // Returns labels for the right ends of lines, each as close to its line as the other labels allow.
  function labels(spec, size, night, inner, [low, high]) {
    const px = (y) => ((y - low) / (high - low)) * inner;
    const all = spec.labels.map((l) => ({ ...l, at: px(l.y) })).sort((a, b) => a.at - b.at);
    const apart = size * 1.25;
    // first shifted upwards from the lowest, then downwards from the highest, so that no label leaves the panel
    all.forEach((l, i) => { if (i) l.at = Math.max(l.at, all[i - 1].at + apart); });
    for (let i = all.length - 1, most = inner - apart / 2; i >= 0; i--, most -= apart) all[i].at = Math.min(all[i].at, most);
    return all.map((l) => ({
      text: l.text, font: { size, color: night || l.color }, showarrow: false, align: "left",
      xref: "paper", x: 1, xanchor: "left", xshift: 4, yref: "y", y: l.y, yshift: l.at - px(l.y), yanchor: "middle",
    }));
  }

  // Returns the range of a panel's values, including error bars, with a margin.
  function span(spec, panel) {
    const ends = spec.traces.filter((t) => t.panel === panel).flatMap((t) =>
      t.y.flatMap((y, i) => { const e = t.error_y ? t.error_y.array[i] : 0; return y === null ? [] : [y - e, y + e]; }));
    const low = Math.min(...ends), high = Math.max(...ends), air = 0.05 * (high - low) || 0.05 * Math.abs(high) || 1;
    return [low - air, high + air];
  }

  // Returns the ratio of height to width of the data in a figure.
  function shape(spec) {
    const size = (axis) => {
      const all = spec.traces.flatMap((t) => t[axis] || []);
      return all.reduce((a, b) => Math.max(a, b), -Infinity) - all.reduce((a, b) => Math.min(a, b), Infinity);
    };
    const ratio = size("y") / size("x");
    return ratio > 0 ? Math.min(Math.max(ratio, 0.4), 2) : 1;
  }

  function draw(place, spec, measured) {
    const night = dark.matches && !printing;
    const ink = night ? "#e6eaee" : "#1b1f24";
    const line = night ? "#39424c" : "#dfe4e8";
    const half = place.parentElement.classList.contains("half");
    const width = printing ? (half ? PAPER / 2 - 10 : PAPER) : place.clientWidth;
    const panels = spec.panels.length;
    const columns = Math.max(1, Math.min(spec.columns, Math.floor(width / (printing ? 170 : 290))));
    const rows = Math.ceil(panels / columns);
    let row = printing ? Math.min(spec.height * 0.55, 250) : spec.height;
    const bars = spec.traces.some((trace) => trace.orientation === "h"); // horizontal bars, which have long names
    const [space, right, top, below, gutter] = printing ? [44, 6, 8, 32, 54] : [62, 12, 30, 44, 66];
    const between = bars ? 2 * gutter : gutter;
    const left = bars ? 2 * space + 20 : space;
    const named = new Set(spec.traces.filter((t) => t.showlegend !== false && t.name).map((t) => t.name));
    const small = printing ? 8 : 11;
    const labelled = spec.labels.length > 0 && width >= 640;
    const longest = Math.max(0, ...spec.labels.map((l) => l.text.length));
    const aside = labelled ? 0.56 * small * longest + 10 : 0;
    const showlegend = named.size > 1 && !labelled;
    // the height of the legend is known only after it is drawn
    const legend = showlegend ? (measured ?? 30) + 6 : 0;
    const shared = spec.shared && columns === 1;
    const gap = shared ? 16 : below + 10;
    const plotWidth = width - left - right - aside;
    // a panel with the same scale on both axes is not higher than its width requires
    if (panels === 1 && spec.panels[0].equal) row = Math.min(row, below + plotWidth * shape(spec));
    const inner = rows * row - below;
    const height = top + rows * row + legend;
    const layout = {
      width, height, uirevision: "keep", hovermode: "closest", dragmode: "zoom",
      margin: { l: left, r: right + aside, t: top, b: below + legend },
      paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
      font: { family: "system-ui, sans-serif", size: printing ? 8 : 12, color: ink },
      legend: { orientation: "h", x: 0, xanchor: "left", yref: "container", y: 0, yanchor: "bottom", tracegroupgap: 0, font: { size: small } },
      showlegend,
      modebar: { color: night ? "#9aa5b1" : "#5b6570", activecolor: ink, bgcolor: "rgba(0,0,0,0)" },
    };
    const domains = [];
    spec.panels.forEach((panel, i) => {
      const suffix = i ? String(i + 1) : "";
      const column = i % columns, line_ = Math.floor(i / columns);
      const w = (plotWidth - (columns - 1) * between) / columns;
      const x0 = (column * (w + between)) / plotWidth;
      const h = (inner - (rows - 1) * gap) / rows;
      const y1 = 1 - (line_ * (h + gap)) / inner;
      const domain = { x: [x0, Math.min(1, x0 + w / plotWidth)], y: [Math.max(0, y1 - h / inner), Math.min(1, y1)] };
      domains.push(domain);
      const common = { gridcolor: line, zerolinecolor: line, linecolor: ink, showline: true, automargin: false, exponentformat: "power", ticks: "outside", tickcolor: line };
      const last = !shared || i === panels - 1;
      layout["xaxis" + suffix] = { ...common, domain: domain.x, anchor: "y" + suffix, title: { text: last ? panel.x : "", standoff: printing ? 4 : 8, font: { size: small + (printing ? 0 : 1) } }, showticklabels: last,
        type: panel.logx ? "log" : "-", nticks: Math.max(3, Math.round(w / 70)) };
      if (panel.logx) Object.assign(layout["xaxis" + suffix], { exponentformat: "none", tickformat: "~g" });
      // ticks at 1, 2 and 5 of every decade, because labels of all digits would overlap
      if (panel.logx && !panel.range && decades(spec, i, "x") >= 1) layout["xaxis" + suffix].dtick = "D2";
      if (panel.range) layout["xaxis" + suffix].range = panel.logx ? panel.range.map(Math.log10) : panel.range;
      if (spec.shared && i) layout["xaxis" + suffix].matches = "x";
      layout["yaxis" + suffix] = { ...common, domain: domain.y, anchor: "x" + suffix, title: { text: panel.y, standoff: 2, font: { size: small } }, type: panel.logy ? "log" : "-", nticks: 6 };
      if (bars) Object.assign(layout["yaxis" + suffix], { type: "category", dtick: 1, tickfont: { size: printing ? 7 : 10 } });
      // ticks at powers of ten; with less than two decades at 1, 2 and 5 of each; within one decade plotly's choice
      if (panel.logy && decades(spec, i) >= 1) layout["yaxis" + suffix].dtick = decades(spec, i) >= 2 ? 1 : "D2";
      if (panel.equal) Object.assign(layout["yaxis" + suffix], { scaleanchor: "x" + suffix, constrain: "domain" });
    });
    if (labelled) {
      layout.yaxis.range = span(spec, 0);
      layout.annotations = labels(spec, small, night && ink, inner, layout.yaxis.range);
    }
    const seen = new Set();
    const traces = spec.traces.map((source) => {
      const trace = JSON.parse(JSON.stringify(source).replaceAll('"@ink"', `"${ink}"`));
      const i = trace.panel, suffix = i ? String(i + 1) : "";
      delete trace.panel;
      trace.xaxis = "x" + suffix;
      trace.yaxis = "y" + suffix;
      if (trace.type === "heatmap") {
        const d = domains[i];
        trace.colorbar = { x: d.x[1], xpad: 2, y: (d.y[0] + d.y[1]) / 2, len: d.y[1] - d.y[0], thickness: 7, tickfont: { size: 9 }, outlinewidth: 0 };
      } else {
        // one legend entry for each name, which shows or hides it in all panels
        trace.showlegend = trace.showlegend !== false && !seen.has(trace.name);
        seen.add(trace.name);
      }
      return trace;
    });
    place.style.height = height + "px";
    // plotly measures sizes while it draws, which a scaled drawing would falsify
    place.querySelectorAll(".main-svg").forEach((svg) => svg.removeAttribute("viewBox"));
    Plotly.react(place, traces, layout, config);
    const found = showlegend && measured === undefined && place._fullLayout.legend._height;
    if (found && Math.abs(found - 30) > 1) return draw(place, spec, found);
    // a figure that is printed wider or narrower than it was drawn keeps its aspect ratio
    place.querySelectorAll(".main-svg").forEach((svg) => svg.setAttribute("viewBox", `0 0 ${width} ${height}`));
    place.style.setProperty("--shape", `${width} / ${height}`);
  }

  const all = () => places.forEach((place, i) => draw(place, figures[i]));
  dark.addEventListener("change", all);
  addEventListener("beforeprint", () => { printing = true; all(); });
  addEventListener("afterprint", () => { printing = false; all(); });
  let width = innerWidth, waiting;
  addEventListener("resize", () => {
    if (innerWidth === width || printing) return;
    width = innerWidth;
    clearTimeout(waiting);
    waiting = setTimeout(all, 150);
  });
  // the figures are drawn one after the other, so that the page can be read meanwhile
  let next = 0;
  (function go() {
    const until = performance.now() + 40;
    while (next < places.length && performance.now() < until) draw(places[next], figures[next++]);
    if (next < places.length) setTimeout(go);
    else document.documentElement.dataset.drawn = "yes";
  })();
})();
