// Figures of a page: drawn when they come into sight, saved as SVG, with a cursor at the time of the replay.
"use strict";
const BUTTONS = [["zoom2d", "pan2d", "resetScale2d"]]; // of Plotly's own, others would upload the figure
const page = { time: null, listeners: [] };

/** Set the time (s) that everything on the page shows; null for none. */
page.setTime = (time) => {
  page.time = time;
  page.listeners.forEach((listener) => listener(time));
};

page.save = (svg, name) => {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([svg], { type: "image/svg+xml" }));
  link.download = `${name.replace(/[^\w.-]+/g, "_")}.svg`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
};

/** Figure as SVG text, light whatever the screen: points that WebGL draws on the page are vectors in it. */
page.svgOf = async (plot) => {
  const vector = (trace) => ({ ...trace, type: trace.type === "scattergl" ? "scatter" : trace.type });
  const size = { width: plot.clientWidth || 900, height: plot.clientHeight || 500 };
  const figure = { data: plot.spec.data.map(vector), layout: { ...plot.spec.layout, ...size } };
  const url = await Plotly.toImage(figure, { format: "svg", ...size });
  return decodeURIComponent(url.slice(url.indexOf(",") + 1));
};

page.drawFigure = (section) => {
  const plot = section.querySelector(".plot");
  if (plot.spec) return plot.drawn;
  plot.spec = JSON.parse(section.querySelector("script").textContent);
  const settings = { displaylogo: false, responsive: true, modeBarButtons: BUTTONS };
  plot.drawn = Plotly.newPlot(plot, plot.spec.data, plot.spec.layout, settings).then(() => {
    if (!("overTime" in plot.dataset)) return;
    plot.on("plotly_afterplot", () => page.moveCursors(plot));
    plot.on("plotly_click", (event) => page.setTime(3600 * event.points[0].x));
    page.moveCursors(plot);
  });
  return plot.drawn;
};

/** Put a line at the time of the replay into each column of a figure over time. */
page.moveCursors = (plot) => {
  plot.querySelectorAll(".cursor").forEach((each) => each.remove());
  const layout = plot._fullLayout;
  if (page.time === null || !layout || !layout._size) return;
  const axes = Object.keys(layout).filter((name) => /^xaxis\d*$/.test(name)).map((name) => layout[name]);
  for (const [offset, axis] of new Map(axes.map((each) => [each._offset, each]))) {
    const along = axis.d2p(page.time / 3600);
    if (!(along >= 0 && along <= axis._length)) continue;
    const line = document.createElement("div");
    line.className = "cursor";
    Object.assign(line.style, { left: `${offset + along}px`, top: `${layout._size.t}px`, height: `${layout._size.h}px` });
    plot.append(line);
  }
};

page.listeners.push(() => document.querySelectorAll(".plot[data-over-time]").forEach((plot) => page.moveCursors(plot)));

addEventListener("DOMContentLoaded", () => {
  const sections = [...document.querySelectorAll(".figure")];
  const seen = new IntersectionObserver(
    (entries) => entries.filter((each) => each.isIntersecting).forEach((each) => page.drawFigure(each.target)),
    { rootMargin: "800px" },
  );
  sections.forEach((section) => {
    seen.observe(section);
    section.querySelector(".svg").addEventListener("click", async () => {
      await page.drawFigure(section);
      page.save(await page.svgOf(section.querySelector(".plot")), section.querySelector("h2").textContent);
    });
  });
  addEventListener("beforeprint", () => sections.filter((each) => each.offsetParent).forEach(page.drawFigure));
  document.querySelectorAll("tr[data-time]").forEach((row) =>
    row.addEventListener("click", () => page.setTime(Number(row.dataset.time))),
  );
});
