// Shows the values of curves where one points, or steps with the arrow keys; without it the page is the same.
"use strict";
(() => {
  const shown = (value) => String(Number(value.toPrecision(4)));
  const nearest = (values, x) => {
    let low = 0, high = values.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (values[middle] > x) high = middle; else low = middle;
    }
    return x - values[low] < values[high] - x ? low : high;
  };
  const share = (panel, x) => panel.log
    ? Math.log(x / panel.low) / Math.log(panel.high / panel.low)
    : (x - panel.low) / (panel.high - panel.low);
  const value = (panel, part) => panel.log
    ? panel.low * (panel.high / panel.low) ** part
    : panel.low + part * (panel.high - panel.low);
  const nearby = ({ path, box }, [across, down], area) => {
    const away = path[0].map((place, i) => Math.hypot((place - across) * box[2] * area.width,
      (path[1][i] - down) * box[3] * area.height));
    return away.indexOf(Math.min(...away));
  };
  const prepare = (figure) => {
    const panels = JSON.parse(figure.dataset.readings);
    delete figure.dataset.readings;
    const plot = figure.querySelector(".plot"), cursor = document.createElement("span");
    const line = document.createElement("p");
    cursor.className = "cursor";
    line.className = "soft values-line";
    line.textContent = "Point at a curve, or step with the arrow keys, to read values.";
    plot.append(cursor);
    plot.after(line);
    let place = 0, at = panels[0];
    const show = (panel, index) => {
      const xs = panel.curves[0].x;
      place = Math.min(Math.max(index, 0), xs.length - 1);
      at = panel;
      const x = xs[place], [left, top, width, height] = panel.box;
      const values = panel.curves.map((curve) => curve.name + " " + shown(curve.y[nearest(curve.x, x)]));
      line.textContent = panel.x + " " + shown(x) + " | " + panel.y + ": " + values.join("; ");
      const [across, down] = panel.path
        ? [panel.path[0][place], panel.path[1][place]] : [share(panel, x), 0];
      cursor.classList.toggle("point", Boolean(panel.path));
      cursor.style.left = 100 * (left + width * across) + "%";
      cursor.style.top = 100 * (top + height * down) + "%";
      cursor.style.height = panel.path ? "" : 100 * height + "%";
      plot.setAttribute("aria-valuenow", place);
      plot.setAttribute("aria-valuemax", xs.length - 1);
      plot.setAttribute("aria-valuetext", line.textContent);
    };
    for (const [name, text] of Object.entries({ tabindex: 0, role: "slider", "aria-valuemin": 0,
      "aria-valuemax": panels[0].curves[0].x.length - 1, "aria-valuenow": 0,
      "aria-label": "Values along the axis", "aria-valuetext": "none yet" })) plot.setAttribute(name, text);
    plot.addEventListener("pointermove", (event) => {
      const area = plot.getBoundingClientRect();
      const across = (event.clientX - area.left) / area.width;
      const down = (event.clientY - area.top) / area.height;
      const panel = panels.find(({ box }) => across >= box[0] && across <= box[0] + box[2]
        && down >= box[1] && down <= box[1] + box[3]);
      if (!panel) return;
      const inside = [(across - panel.box[0]) / panel.box[2], (down - panel.box[1]) / panel.box[3]];
      show(panel, panel.path ? nearby(panel, inside, area)
        : nearest(panel.curves[0].x, value(panel, inside[0])));
    });
    plot.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: -1, ArrowRight: 1, ArrowDown: -1, ArrowUp: 1, PageDown: -20, PageUp: 20,
        Home: -Infinity, End: Infinity }[event.key];
      if (step) { event.preventDefault(); show(at, place + step); }
    });
  };
  const all = () => document.querySelectorAll("figure").forEach((figure) => {
    if (figure.dataset.readings) prepare(figure);
  });
  document.addEventListener("DOMContentLoaded", all);
  document.addEventListener("replaced", all);
})();
