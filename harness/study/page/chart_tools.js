// Axes, colours and ranks of the explorer's charts.
'use strict';
// columns: of the study's table, with name, label and, for texts, labels. byId: finds an element of the explorer.
const MakeChartTools = (columns, byId) => {
  const style = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const Ticks = axis => {
    const labels = columns[axis.column].labels;
    if (labels) return labels.map((_, i) => i);
    if (axis.log) {
      const first = Math.ceil(Math.log10(axis.least)), last = Math.floor(Math.log10(axis.most));
      if (last > first) {
        const every = Math.ceil((last - first + 1) / 6);
        return Array.from({length: Math.floor((last - first) / every) + 1}, (_, i) => 10 ** (first + i * every));
      }
      return [axis.least, axis.most];
    }
    const rough = (axis.most - axis.least) / 4;
    if (!(rough > 0)) return [axis.least];
    const decade = 10 ** Math.floor(Math.log10(rough));
    const step = decade * [1, 2, 5, 10].find(digit => digit * decade >= rough);
    const ticks = [];
    for (let k = Math.ceil(axis.least / step); k * step <= axis.most; ++k) ticks.push(k * step);
    return ticks;
  };
  const FormatTick = (x, column) => {
    if (columns[column].labels) return columns[column].labels[x];
    const rounded = Number(x.toPrecision(3));
    return rounded !== 0 && (Math.abs(rounded) < 1e-3 || Math.abs(rounded) >= 1e6) ? rounded.toExponential() : String(rounded);
  };

  const Begin = id => {
    const canvas = byId(id);
    const box = canvas.getBoundingClientRect();
    canvas.width = Math.round(box.width * devicePixelRatio);
    canvas.height = Math.round(box.height * devicePixelRatio);
    const g = canvas.getContext('2d');
    g.scale(devicePixelRatio, devicePixelRatio);
    g.font = '11px sans-serif';
    g.fillStyle = style('--ink') || '#222';
    g.strokeStyle = style('--line') || '#ccc';
    return {g, w: box.width, h: box.height, canvas};
  };
  const DrawAxes = (g, w, h, x, y) => {
    g.strokeRect(60, 10, w - 70, h - 50);
    g.textAlign = 'center';
    for (const tick of Ticks(x)) g.fillText(FormatTick(tick, x.column), x.place(tick), h - 26);
    g.fillText(columns[x.column].label, 60 + (w - 70) / 2, h - 8);
    g.textAlign = 'right';
    for (const tick of Ticks(y)) g.fillText(FormatTick(tick, y.column), 56, y.place(tick) + 4);
    g.save();
    g.translate(11, 10 + (h - 50) / 2);
    g.rotate(-Math.PI / 2);
    g.textAlign = 'center';
    g.fillText(columns[y.column].label, 0, 0);
    g.restore();
  };
  const Viridis = share => {
    const mix = (a, b, c) => Math.round(share < 0.5 ? a + 2 * share * (b - a) : b + (2 * share - 1) * (c - b));
    return `rgb(${mix(255, 65, 8)},${mix(255, 182, 29)},${mix(204, 196, 88)})`;
  };
  const Ranks = values => {
    const order = values.map((v, i) => [v, i]).sort((a, b) => a[0] - b[0]);
    const ranks = new Float64Array(values.length);
    for (let i = 0; i < order.length;) {
      let j = i;
      while (j < order.length && order[j][0] === order[i][0]) ++j;
      for (let k = i; k < j; ++k) ranks[order[k][1]] = (i + j - 1) / 2;
      i = j;
    }
    return ranks;
  };
  const Correlation = (a, b) => {
    const n = a.length, mean = (n - 1) / 2;
    let ab = 0, aa = 0, bb = 0;
    for (let i = 0; i < n; ++i) {
      ab += (a[i] - mean) * (b[i] - mean);
      aa += (a[i] - mean) ** 2;
      bb += (b[i] - mean) ** 2;
    }
    return aa > 0 && bb > 0 ? ab / Math.sqrt(aa * bb) : 0;
  };
  // Of points with two quantities, those that no other one beats in both, by the first quantity.
  const FindFront = (points, a, b, xColumn, yColumn) => {
    const sx = columns[xColumn].larger ? -1 : 1, sy = columns[yColumn].larger ? -1 : 1;
    let best = Infinity;
    return points.sort((p, q) => sx * (a(p) - a(q)) || sy * (b(p) - b(q))).filter(point => {
      const better = sy * b(point) < best;
      if (better) best = sy * b(point);
      return better;
    });
  };
  // For a shell.
  const Quote = text => /^[\w.,:=+[\]/-]+$/.test(text) && !/[[\]]/.test(text) ? text : "'" + text.replaceAll("'", "'\\''") + "'";
  return {style, Ticks, FormatTick, Begin, DrawAxes, Viridis, Ranks, Correlation, FindFront, Quote};
};
