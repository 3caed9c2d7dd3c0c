// Replaces the still curves of a page by ones with tooltips and zoom, drawn on uPlot's axes. Without it the still ones stay.
"use strict";
(() => {
  const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

  // 1, 2 and 5 times powers of ten, or powers alone where these would stand too near.
  function ticks(low, high, room) {
    const decades = Math.log10(high / low);
    const digits = room / decades > 120 ? [1, 2, 5] : [1];
    const every = Math.max(1, Math.ceil(36 * decades / room));
    const found = [];
    for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); power += every) {
      for (const digit of digits) found.push(digit * 10 ** power);
    }
    const inside = found.filter((x) => x >= low && x <= high);
    return inside.length > 1 ? inside : [low, high];
  }

  const number = (x) => x >= 1e6 || x < 1e-4 ? x.toExponential(0) : String(Number(x.toPrecision(2)));

  function axis(label, text, side) {
    return {
      label, labelGap: 4, stroke: () => css("--dim"), grid: { stroke: () => css("--rule"), width: 1 }, ticks: { show: false },
      font: "12px system-ui, sans-serif", labelFont: "600 12px system-ui, sans-serif", size: side === 0 ? 30 : 54, labelSize: side === 0 ? 22 : 0,
      splits: (u, _, low, high) => ticks(low, high, (side === 0 ? u.bbox.width : 1.5 * u.bbox.height) / devicePixelRatio),
      filter: (_, splits) => splits, values: (_, splits) => splits.map(text),
    };
  }

  function interactive(figure) {
    const { x, y, chart } = JSON.parse(figure.querySelector("script").textContent);
    const holder = figure.insertBefore(document.createElement("div"), figure.lastElementChild);
    holder.className = "interactive";
    const name = holder.appendChild(document.createElement("p"));
    name.className = "axis-name";
    name.textContent = chart.y_name;
    const tip = document.createElement("div");
    tip.className = "tip";
    const legend = document.createElement("p");
    legend.className = "keys";
    for (const curve of chart.curves) {
      const entry = legend.appendChild(document.createElement("span"));
      entry.className = curve.class;
      entry.innerHTML = `<svg class="chart key" viewBox="-1.5 -1.5 3 3"><path class="${curve.hollow ? "hollow" : "solid"}" d="${curve.marker}"/></svg> `;
      entry.append(curve.name);
      curve.element = entry;
    }

    function draw(u) {
      const { ctx, bbox } = u, unit = devicePixelRatio;
      const at = (px, py) => [u.valToPos(px, "x", true), u.valToPos(Math.max(py, 1e-30), "y", true)];
      const line = (points, width, dash) => {
        ctx.beginPath();
        for (const [px, py] of points) ctx.lineTo(...at(px, py));
        ctx.lineWidth = width * unit;
        ctx.setLineDash(dash.map((d) => d * unit));
        ctx.stroke();
      };
      const marker = (curve, [px, py], r, hollow) => {
        ctx.save();
        ctx.translate(px, py);
        ctx.scale(r * unit, r * unit);
        ctx.setLineDash([]);
        ctx.lineWidth = (hollow ? 1.6 : 1) / r;
        const outline = new Path2D(curve.marker), [paper, color] = [css("--paper"), ctx.strokeStyle];
        [ctx.fillStyle, ctx.strokeStyle] = hollow ? [paper, color] : [color, paper];
        ctx.fill(outline);
        ctx.stroke(outline);
        ctx.restore();
      };
      ctx.save();
      ctx.beginPath();
      ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
      ctx.clip();
      ctx.strokeStyle = css("--dim");
      for (const target of chart.targets) line([[x[0] / 1e3, target], [x[1] * 1e3, target]], 1, [1, 3]);
      for (const curve of chart.curves) {
        ctx.strokeStyle = ctx.fillStyle = getComputedStyle(curve.element).color;
        const [low, high] = [(p) => p.y.low ?? 1e-30, (p) => p.y.high ?? 1e30];
        if (!curve.thin) {
          ctx.globalAlpha = 0.14;
          ctx.beginPath();
          for (const p of curve.points) ctx.lineTo(...at(p.x, high(p)));
          for (const p of curve.points.toReversed()) ctx.lineTo(...at(p.x, low(p)));
          ctx.fill();
          ctx.globalAlpha = 1;
        }
        line(curve.points.map((p) => [p.x, p.y.value]), curve.thin ? 1.25 : 2, curve.dash.split(" ").filter(Boolean).map(Number));
        line(curve.beyond, 1.75, [1, 4.5]);
        if (curve.marked) curve.beyond.slice(1).forEach((p) => marker(curve, at(...p), 3.5, true));
        for (const p of curve.points) {
          line([[p.x, low(p)], [p.x, high(p)]], 1.5, []);
          marker(curve, at(p.x, p.y.value), curve.thin ? 2.8 : 4, curve.hollow);
        }
      }
      ctx.restore();
    }

    function hover(u) {
      const { left, top } = u.cursor;
      let [nearest, least] = [null, 24];
      for (const curve of left < 0 ? [] : chart.curves) {
        for (const p of curve.points) {
          const [px, py] = [u.valToPos(p.x, "x"), u.valToPos(p.y.value, "y")], far = Math.hypot(px - left, py - top);
          if (far < least) [nearest, least] = [{ px, py, text: `${curve.name}: ${p.note}` }, far];
        }
      }
      tip.hidden = !nearest;
      if (!nearest) return;
      tip.textContent = nearest.text;
      const room = u.over.clientWidth - tip.offsetWidth;
      tip.style.left = `${Math.max(0, Math.min(nearest.px + 10, room))}px`;
      tip.style.top = `${nearest.py + (nearest.py > 60 ? -tip.offsetHeight - 10 : 14)}px`;
    }

    const size = () => ({ width: holder.clientWidth, height: holder.clientWidth < 500 ? 290 : 390 });
    const scale = { distr: 3, time: false, range: (_, low, high) => [low, high] };
    const plot = new uPlot({
      ...size(),
      scales: { x: scale, y: scale },
      series: [{}, { stroke: "transparent", points: { show: false } }],
      axes: [axis(chart.x_name, number, 0), axis(undefined, (v) => `${number(100 * v)}\u202f%`, 3)],
      legend: { show: false },
      cursor: { drag: { x: true, y: true, uni: 20 }, points: { show: false } },
      hooks: { draw: [draw], setCursor: [hover] },
    }, [x, y], holder);
    plot.over.append(tip);
    tip.hidden = true;
    holder.append(legend);
    new ResizeObserver(() => plot.setSize(size())).observe(holder);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => plot.redraw());
    figure.classList.add("has-interactive");
    figure.lastElementChild.append(" Drag over a part to enlarge it; a double click shows the whole again.");
  }

  document.querySelectorAll("figure[data-curves]").forEach(interactive);
})();
