// Draws the page's figures with plotly: in the reader's light or dark colours, with as many panels
// beside each other as there is room for, and for paper at its width.
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

  // How many powers of ten the values of a panel span.
  function decades(spec, panel) {
    const logs = spec.traces.filter((t) => t.panel === panel).flatMap((t) => t.y).filter((y) => y > 0).map(Math.log10);
    return logs.reduce((a, b) => Math.max(a, b), -Infinity) - logs.reduce((a, b) => Math.min(a, b), Infinity);
  }

  function draw(place, spec) {
    const night = dark.matches && !printing;
    const ink = night ? "#e6eaee" : "#1b1f24";
    const line = night ? "#39424c" : "#dfe4e8";
    const half = place.parentElement.classList.contains("half");
    const width = printing ? (half ? PAPER / 2 - 10 : PAPER) : place.clientWidth;
    const panels = spec.panels.length;
    const columns = Math.max(1, Math.min(spec.columns, Math.floor(width / (printing ? 170 : 290))));
    const rows = Math.ceil(panels / columns);
    const row = printing ? Math.min(spec.height * 0.62, 250) : spec.height;
    const bars = spec.traces.some((trace) => trace.orientation === "h"); // whose names are long
    const [space, right, top, below, gutter] = printing ? [44, 6, 8, 32, 44] : [62, 12, 30, 44, 66];
    const between = bars ? 2 * gutter : gutter;
    const left = bars ? 2 * space + 20 : space;
    const named = new Set(spec.traces.filter((t) => t.showlegend !== false && t.name).map((t) => t.name));
    const perLine = Math.max(1, Math.floor((width - 20) / (printing ? 120 : 190)));
    const legend = named.size > 1 ? (printing ? 13 : perLine > 1 ? 25 : 30) * Math.ceil(named.size / perLine) + 14 : 0;
    const shared = spec.shared && columns === 1;
    const gap = shared ? 16 : below + 10;
    const inner = rows * row - below;
    const height = top + rows * row + legend;
    const plotWidth = width - left - right;
    const layout = {
      width, height, uirevision: "keep", hovermode: "closest", dragmode: "zoom",
      margin: { l: left, r: right, t: top, b: below + legend },
      paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
      font: { family: "system-ui, sans-serif", size: printing ? 8 : 12, color: ink },
      legend: { orientation: "h", x: 0, xanchor: "left", yref: "container", y: 0, yanchor: "bottom", font: { size: printing ? 8 : 11 } },
      showlegend: named.size > 1,
      modebar: { color: night ? "#9aa5b1" : "#5b6570", bgcolor: "rgba(0,0,0,0)" },
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
      layout["xaxis" + suffix] = { ...common, domain: domain.x, anchor: "y" + suffix, title: { text: last ? panel.x : "", standoff: printing ? 4 : 10 }, showticklabels: last,
        type: panel.logx ? "log" : "-", nticks: Math.max(3, Math.round(w / 70)) };
      if (panel.logx) Object.assign(layout["xaxis" + suffix], { exponentformat: "none", tickformat: "~g" });
      if (panel.range) layout["xaxis" + suffix].range = panel.logx ? panel.range.map(Math.log10) : panel.range;
      if (spec.shared && i) layout["xaxis" + suffix].matches = "x";
      layout["yaxis" + suffix] = { ...common, domain: domain.y, anchor: "x" + suffix, title: { text: panel.y, standoff: 2, font: { size: printing ? 8 : 11 } }, type: panel.logy ? "log" : "-", nticks: 6 };
      if (bars) Object.assign(layout["yaxis" + suffix], { type: "category", dtick: 1, tickfont: { size: printing ? 7 : 10 } });
      // at powers of ten; where there are less than two of them, where plotly puts them
      if (panel.logy && decades(spec, i) >= 2) layout["yaxis" + suffix].dtick = 1;
      if (panel.equal) Object.assign(layout["yaxis" + suffix], { scaleanchor: "x" + suffix, constrain: "domain" });
    });
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
        // one entry for a name, which switches it in all panels
        trace.showlegend = trace.showlegend !== false && !seen.has(trace.name);
        seen.add(trace.name);
      }
      return trace;
    });
    place.style.height = height + "px";
    Plotly.react(place, traces, layout, config);
    // what is printed wider or narrower than drawn keeps its shape
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
  // one after the other, so that the page can be read meanwhile
  let next = 0;
  (function go() {
    const until = performance.now() + 40;
    while (next < places.length && performance.now() < until) draw(places[next], figures[next++]);
    if (next < places.length) setTimeout(go);
    else document.documentElement.dataset.drawn = "yes";
  })();
})();
