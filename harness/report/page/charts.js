// What Chart.js gets of a page's charts: axes, and of a study's bars with intervals, scatter plots, maps of cells. Every point and cell can
// lead to a trial.
'use strict';
const MakeCharts = () => {
  const style = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const charts = new Map();  // by canvas
  Chart.defaults.animation = false;
  Chart.defaults.maintainAspectRatio = false;
  Chart.defaults.font.family = 'system-ui, "DejaVu Sans", sans-serif';
  // As the page has them, light or dark.
  const SetColors = () => Object.assign(Chart.defaults, {color: style('--soft'), borderColor: style('--line')});
  SetColors();
  const Draw = (canvas, config) => {
    charts.get(canvas)?.destroy();
    charts.set(canvas, new Chart(canvas, config));
    return charts.get(canvas);
  };
  const Short = (x, digits = 3) => {
    const rounded = Number(x.toPrecision(digits));
    return rounded !== 0 && (Math.abs(rounded) < 1e-3 || Math.abs(rounded) >= 1e6) ? rounded.toExponential() : String(rounded);
  };
  const IsWide = (least, most) => least > 0 && most / least > 30;
  // From pale yellow over green to dark blue.
  const ColorOf = fraction => {
    const mix = (a, b, c) => Math.round(fraction < 0.5 ? a + 2 * fraction * (b - a) : b + (2 * fraction - 1) * (c - b));
    return `rgb(${mix(255, 65, 8)},${mix(255, 182, 29)},${mix(204, 196, 88)})`;
  };

  // A label in lines of at most about 14 letters.
  const Wrap = text => text.length > 14 ? text.match(/.{1,14}(?:[_ .,-]|$)|.+/g) : text;
  // Ends of an axis for these numbers; none where they differ by rounding only.
  const EndsOf = (numbers, log) => {
    const finite = numbers.filter(x => Number.isFinite(x) && (!log || x > 0));
    const least = finite.reduce((a, b) => Math.min(a, b), Infinity), most = finite.reduce((a, b) => Math.max(a, b), -Infinity);
    if (!(most - least > 1e-9 * Math.max(Math.abs(least), Math.abs(most)))) return [];
    const room = 0.04 * (log ? Math.log(most / least) : most - least);
    return log ? [least * Math.exp(-room), most * Math.exp(room)] : [least >= 0 ? Math.max(least - room, 0) : least - room, most + room];
  };

  // An axis: {label, labels (texts of 0, 1, ..), log, ticks (the only ones)}.
  const MakeAxis = (axis, least, most) => {
    const scale = {title: {display: true, text: axis.label}, type: axis.log ? 'logarithmic' : 'linear', min: least, max: most,
      ticks: {maxRotation: 50, includeBounds: false}};
    const SetTicks = values => scale => { scale.ticks = values.map(value => ({value})); };
    if (axis.labels) {
      return {...scale, type: 'linear', min: -0.5, max: axis.labels.length - 0.5, afterBuildTicks: SetTicks(axis.labels.map((_, i) => i)),
        ticks: {...scale.ticks, autoSkip: false, callback: i => Wrap(axis.labels[i])}};
    }
    if (axis.ticks) return {...scale, afterBuildTicks: SetTicks(axis.ticks), ticks: {...scale.ticks, callback: x => Short(x)}};
    // Neighbours differ in their last digit.
    const Tick = (x, i, ticks) => ticks.length < 2 ? Short(x) : Short(x, Math.max(3, 1 + Math.ceil(
      Math.log10(Math.max(...ticks.map(tick => Math.abs(tick.value))) / Math.abs(ticks[1].value - ticks[0].value)))));
    const LogTick = (x, i, ticks) => Number.isInteger(Math.log10(x)) || ticks.length < 8 ? Short(x) : null;
    return {...scale, ticks: {...scale.ticks, callback: axis.log ? LogTick : Tick}};
  };
  const Legend = shown => ({display: shown, position: 'bottom', labels: {boxWidth: 14}});
  const Choose = choose => (_, elements, chart) => {
    const point = elements.map(e => chart.data.datasets[e.datasetIndex].data[e.index]).find(p => p.row !== undefined);
    // Later, for charts are drawn anew by it: this one still has the event to finish.
    if (point) setTimeout(() => choose(point.row));
  };
  const Tip = describe => ({callbacks: {title: () => '', label: item => describe(item.raw)}});

  // Bars along labels: sets of {label, values, color, thin}; a value may be [from, to].
  const Bars = (canvas, {labels, sets, unit = '', log = false, least, most}) => {
    const thin = sets.some(set => set.thin);
    const lines = labels.map(Wrap), most_lines = Math.max(...lines.map(line => [line].flat().length));
    canvas.parentElement.style.height = 110 + labels.length * (Math.max(thin ? 20 : 14 * sets.length, 15 * most_lines) + 4) + 'px';
    return Draw(canvas, {
      type: 'bar',
      data: {labels: lines, datasets: sets.map(set => ({label: set.label, data: set.values, backgroundColor: set.color, grouped: !thin,
        barThickness: set.thin ? 3 : thin ? 14 : undefined, order: set.thin ? 0 : 1}))},
      options: {indexAxis: 'y', plugins: {legend: Legend(sets.length > 1), tooltip: {callbacks: {label: item =>
        item.dataset.label + ' ' + [item.raw].flat().map(x => Short(x)).join(' to ') + (unit ? ' ' + unit : '')}}},
        scales: {x: MakeAxis({label: unit, log}, least, most), y: {ticks: {autoSkip: false}}}}
    });
  };

  // Points {x, y, row, color} and lines {label, points, color}. describe(point): text beside a point.
  const Scatter = (canvas, {x, y, points, lines = [], chosen, choose, describe}) => Draw(canvas, {
    type: 'scatter',
    data: {datasets: [
      {label: 'chosen', data: points.filter(p => p.row === chosen), pointRadius: 7, pointBorderWidth: 2, pointHitRadius: 0, order: 0,
        backgroundColor: 'transparent', borderColor: style('--accent')},
      ...lines.map(line => ({label: line.label, data: line.points, showLine: true, borderColor: line.color,
        backgroundColor: 'transparent', pointRadius: 0, pointHitRadius: 0, borderWidth: 1.8, order: 1})),
      {label: 'trials', data: points, order: 2, backgroundColor: points.map(p => p.color), pointRadius: points.length > 3000 ? 1.5 : 3.5}]},
    options: {onClick: Choose(choose), plugins: {legend: {...Legend(lines.length > 0),
      labels: {boxWidth: 14, filter: item => lines.some(line => line.label === item.text)}}, tooltip: Tip(describe)},
      scales: {x: MakeAxis(x, ...EndsOf(points.map(p => p.x), x.log)), y: MakeAxis(y, ...EndsOf(points.map(p => p.y), y.log))}}
  });

  // Cells {x: [from, to], y: [from, to], row, color}.
  const Cells = (canvas, {x, y, cells, chosen, choose, describe}) => {
    const ends = (of, i) => cells.reduce((best, c) => (i ? Math.max : Math.min)(best, c[of][i]), i ? -Infinity : Infinity);
    const middle = ([from, to], axis) => axis.log ? Math.sqrt(from * to) : (from + to) / 2;
    const rectangles = {id: 'cells', beforeDatasetsDraw: ({ctx, scales}) => {
      for (const cell of cells) {
        const [left, right] = cell.x.map(v => scales.x.getPixelForValue(v));
        const [bottom, top] = cell.y.map(v => scales.y.getPixelForValue(v));
        ctx.fillStyle = cell.color;
        ctx.fillRect(left, top, right - left + 0.5, bottom - top + 0.5);
        if (cell.row !== chosen) continue;
        ctx.strokeStyle = style('--ink');
        ctx.lineWidth = 3;
        ctx.strokeRect(left + 1.5, top + 1.5, right - left - 3, bottom - top - 3);
      }
    }};
    return Draw(canvas, {
      type: 'scatter', plugins: [rectangles],
      data: {datasets: [{data: cells.map(cell => ({...cell, x: middle(cell.x, x), y: middle(cell.y, y)})),
        pointRadius: 0, pointHitRadius: 12}]},
      options: {onClick: Choose(choose), plugins: {legend: Legend(false), tooltip: Tip(describe)},
        interaction: {mode: 'nearest', intersect: false},
        scales: {x: MakeAxis(x, ends('x', 0), ends('x', 1)), y: MakeAxis(y, ends('y', 0), ends('y', 1))}}
    });
  };

  return {style, SetColors, Short, IsWide, ColorOf, MakeAxis, Bars, Scatter, Cells};
};
