// The report's plots: zoomed together, drawn when they come into view.
(() => {
  'use strict';
  const groups = ReadJson('run-plots');
  const numbers = new Float32Array(ReadBytes('run-values'));
  const plots = groups.flatMap(({times, plots}) => plots.map(plot => ({...plot, times})));
  const dark = matchMedia('(prefers-color-scheme: dark)');
  const first = Math.min(...groups.map(({times}) => times[0]));
  const last = Math.max(first + 1e-6, ...groups.map(({times}) => times.at(-1)));
  const {MakeAxis, SetColors} = MakeCharts();
  const charts = new Map();  // with what each shows
  let shown = [first, last];

  /** The page's one time: what the line in the plots, their values and the replay show. */
  const clock = {
    time: first,
    listeners: [],
    isPlaying: () => false,
    set(time) {
      clock.time = Math.min(Math.max(time, first), last);
      for (const listener of clock.listeners) listener(clock.time);
    },
  };
  window.runClock = clock;

  /** The row nearest a time. */
  const findRow = ({times}, time) => {
    let low = 0;
    let high = times.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (times[middle] <= time) low = middle; else high = middle;
    }
    return time - times[low] <= times[high] - time ? low : high;
  };

  const format = value => {
    if (!Number.isFinite(value)) return '–';
    if (value === 0) return '0';
    const size = Math.abs(value);
    return size < 1e-3 || size >= 1e5 ? value.toExponential(2) : String(Number(value.toPrecision(5)));
  };

  const isDrawn = (plot, value) => Number.isFinite(value) && !(plot.log && value <= 0);

  /** A curve's rows in a range of time; of more than two a pixel the least and the largest, so that no peak is lost. */
  const makePoints = (plot, curve, [from, to], pixels) => {
    const {times} = plot, valueAt = row => numbers[curve.begin + row];
    const begin = Math.max(findRow(plot, from) - 1, 0), end = Math.min(findRow(plot, to) + 2, times.length);
    const stride = Math.max(1, Math.ceil((end - begin) / pixels / 2));
    const points = [];
    for (let i = begin; i < end; i += stride) {
      let low = -1, high = -1;
      for (let row = i; row < Math.min(i + stride, end); ++row) {
        if (!isDrawn(plot, valueAt(row))) continue;
        if (low < 0 || valueAt(row) < valueAt(low)) low = row;
        if (high < 0 || valueAt(row) > valueAt(high)) high = row;
      }
      const rows = low === high ? [low] : [Math.min(low, high), Math.max(low, high)];
      for (const row of rows) points.push(row < 0 ? {x: times[i], y: NaN} : {x: times[row], y: valueAt(row)});
    }
    return points;
  };

  const showRange = (chart, plot) => {
    Object.assign(chart.options.scales.x, {min: shown[0], max: shown[1]});
    plot.curves.forEach((curve, k) => {
      chart.data.datasets[k].data = makePoints(plot, curve, shown, chart.chartArea?.width ?? 450);
    });
    chart.update();
  };
  const showTogether = ([from, to]) => {
    shown = [Math.max(from, first), Math.min(to, last)];
    for (const [chart, plot] of charts) showRange(chart, plot);
  };

  /** What lies within a plot's band. */
  const band = {id: 'band', beforeDatasetsDraw: ({ctx, chartArea: {left, top, width, bottom}, scales, config}) => {
    const [high, low] = [1, -1].map(side => Math.min(Math.max(scales.y.getPixelForValue(side * config.options.band), top), bottom));
    if (!(low > high)) return;
    ctx.save();
    ctx.fillStyle = dark.matches ? '#5fd3a540' : '#0c735030';
    ctx.fillRect(left, high, width, low - high);
    ctx.restore();
  }};

  /** A dashed line at a plot's bound. */
  const boundLine = {id: 'bound', beforeDatasetsDraw: ({ctx, chartArea, scales, config}) => {
    const y = scales.y.getPixelForValue(config.options.bound ?? NaN);
    if (!(y >= chartArea.top && y <= chartArea.bottom)) return;
    ctx.save();
    ctx.strokeStyle = dark.matches ? '#ff8f85' : '#c02020';
    ctx.setLineDash([8, 5]);
    ctx.beginPath();
    ctx.moveTo(chartArea.left, y);
    ctx.lineTo(chartArea.right, y);
    ctx.stroke();
    ctx.restore();
  }};

  /** Ticks of a logarithmic axis: powers of ten, at most one for each 28 pixels; below two decades, 2 and 5 too. */
  const tickDecades = (low, high) => {
    const from = Math.ceil(Math.log10(low) - 1e-9);
    const to = Math.floor(Math.log10(high) + 1e-9);
    const stride = Math.max(1, Math.ceil((to - from + 1) * 28 / 200));
    const ticks = [];
    for (let decade = from - 1; decade <= to; ++decade) {
      for (const digit of to - from < 2 ? [1, 2, 5] : [1]) {
        const value = digit * 10 ** decade;
        if (value >= low && value <= high && decade % stride === 0) ticks.push({value});
      }
    }
    return ticks;
  };

  /** An axis of a plot's values, as wide as those of the plots above and below. */
  const makeAxis = (plot, label, range, isRight) => ({
    ...MakeAxis({label, log: plot.log}, ...range),
    position: isRight ? 'right' : 'left',
    grid: {drawOnChartArea: !isRight},
    afterFit: scale => { scale.width = Math.max(scale.width, 78); },
    ...(plot.log ? {afterBuildTicks: scale => { scale.ticks = tickDecades(scale.min, scale.max); }} : {}),
    ticks: {includeBounds: false, autoSkip: !plot.log, maxTicksLimit: 8, callback: value => {
      const exponent = Math.floor(Math.log10(Math.abs(value)) + 1e-9);
      return plot.log && (exponent < -2 || exponent > 3) ? `${Math.round(value / 10 ** exponent)}e${exponent}`
        : format(Number(value.toPrecision(4)));
    }},
  });

  /** Drag to zoom, Shift-drag to move, two fingers to zoom; one finger scrolls the page. */
  const listen = (chart, frame) => {
    const {canvas} = chart;
    const timeAt = pixel => chart.scales.x.getValueForPixel(pixel);
    const isWide = (event, start) => Math.abs(event.offsetX - start.x) >= Math.abs(event.offsetY - start.y);
    let start = null, pinch = null;
    canvas.addEventListener('pointerdown', event => {
      if (event.pointerType === 'touch' || event.button !== 0) return;
      canvas.setPointerCapture(event.pointerId);
      start = {x: event.offsetX, y: event.offsetY, moves: event.shiftKey, range: shown, width: chart.chartArea.width};
    });
    canvas.addEventListener('pointermove', event => {
      if (!start) {
        if (event.pointerType !== 'touch' && !clock.isPlaying()) clock.set(timeAt(event.offsetX));
      } else if (start.moves) {
        const by = (start.x - event.offsetX) / start.width * (start.range[1] - start.range[0]);
        const room = Math.min(Math.max(by, first - start.range[0]), last - start.range[1]);
        showTogether(start.range.map(time => time + room));
      } else {
        const {left, top, width, height} = chart.chartArea, wide = isWide(event, start);
        frame.hidden = false;
        frame.style.cssText = wide
          ? `left: ${Math.min(start.x, event.offsetX)}px; width: ${Math.abs(event.offsetX - start.x)}px; top: ${top}px; height: ${height}px`
          : `top: ${Math.min(start.y, event.offsetY)}px; height: ${Math.abs(event.offsetY - start.y)}px; left: ${left}px; width: ${width}px`;
      }
    });
    canvas.addEventListener('pointerup', event => {
      const begun = start;
      start = null;
      frame.hidden = true;
      if (!begun || begun.moves) return;
      const wide = isWide(event, begun), size = wide ? event.offsetX - begun.x : event.offsetY - begun.y;
      if (Math.abs(size) < 8) {
        clock.set(timeAt(event.offsetX));
      } else if (wide) {
        showTogether([begun.x, event.offsetX].sort((a, b) => a - b).map(timeAt));
      } else {
        for (const [name, scale] of Object.entries(chart.scales)) {
          if (name === 'x') continue;
          const [max, min] = [begun.y, event.offsetY].sort((a, b) => a - b).map(y => scale.getValueForPixel(y));
          Object.assign(chart.options.scales[name], {min, max});
        }
        chart.update();
      }
    });
    canvas.addEventListener('dblclick', () => showAll());
    canvas.addEventListener('touchmove', event => {
      if (event.touches.length !== 2) return;
      event.preventDefault();
      const {left} = canvas.getBoundingClientRect();
      const [a, b] = [...event.touches].map(touch => touch.clientX - left).sort((p, q) => p - q);
      pinch ??= [timeAt(a), timeAt(b)];  // stay under the fingers
      const slope = (pinch[1] - pinch[0]) / Math.max(b - a, 1);
      showTogether([pinch[0] - (a - chart.chartArea.left) * slope, pinch[1] + (chart.chartArea.right - b) * slope]);
    }, {passive: false});
    canvas.addEventListener('touchend', () => { pinch = null; });
  };

  const makeKeys = (plot, box, chart) => plot.curves.map((curve, k) => {
    const key = document.createElement('button');
    const line = `<svg viewBox="0 0 22 8"><line x1="0" y1="4" x2="22" y2="4" stroke="${curve.color}" ` +
        `stroke-width="${curve.wide ? 7 : 2.5}" stroke-opacity="${curve.wide ? 0.4 : 1}" ` +
        `stroke-dasharray="${curve.dashes.join(' ')}"/></svg>`;
    key.innerHTML = line;
    key.append(curve.label);
    const value = document.createElement('span');
    value.className = 'number';
    key.append(value);
    key.setAttribute('aria-pressed', 'true');
    key.title = 'Show or hide';
    key.addEventListener('click', () => {
      const visible = !chart.isDatasetVisible(k);
      chart.setDatasetVisibility(k, visible);
      chart.update();
      key.setAttribute('aria-pressed', String(visible));
    });
    box.append(key);
    return value;
  });

  const draw = (box, plot) => {
    const place = box.querySelector('.plot');
    const line = Make('i', '', {className: 'now'}), frame = Make('i', '', {className: 'zoom', hidden: true});
    const canvas = Make('canvas', '', {role: 'img', ariaLabel: plot.title});
    Add(place, canvas, line, frame);
    const placeLine = ({chartArea, scales}) => {
      const x = scales.x.getPixelForValue(clock.time);
      line.hidden = !(x >= chartArea.left && x <= chartArea.right);
      line.style.cssText = `left: ${x}px; top: ${chartArea.top}px; height: ${chartArea.height}px`;
    };
    const chart = new Chart(canvas, {
      type: 'line',
      plugins: [band, boundLine, {id: 'now', afterUpdate: placeLine}],
      data: {datasets: plot.curves.map(curve => ({
        label: curve.label,
        data: [],
        yAxisID: curve.right ? 'y2' : 'y',
        borderColor: curve.color + (curve.wide ? '66' : ''),
        borderDash: curve.dashes,
        borderWidth: curve.wide ? 6 : curve.background ? 0.8 : 1.5,
        pointRadius: 0,
      }))},
      options: {
        bound: plot.bound,
        band: plot.band ?? NaN,
        parsing: false,
        normalized: true,
        events: [],
        plugins: {legend: {display: false}, tooltip: {enabled: false}},
        scales: {
          x: {...MakeAxis({label: 't (s)'}, ...shown), grid: {}, ticks: {includeBounds: false, maxRotation: 0,
            callback: value => format(Number(value.toPrecision(4)))}},
          y: makeAxis(plot, plot.label, plot.range, false),
          ...(plot.right ? {y2: makeAxis(plot, plot.right, plot.right_range, true)} : {}),
        },
      },
    });
    charts.set(chart, plot);
    box.chart = chart;
    showRange(chart, plot);
    listen(chart, frame);
    const values = makeKeys(plot, box.querySelector('.keys'), chart);
    const showValues = () => {
      placeLine(chart);
      const row = findRow(plot, clock.time);
      values.forEach((value, k) => {
        const number = numbers[plot.curves[k].begin + row];
        value.textContent = format(isDrawn(plot, number) ? number : NaN);
      });
      box.querySelector('.time').textContent = `t = ${plot.times[row].toFixed(3)} s`;
    };
    clock.listeners.push(showValues);
    showValues();
  };

  const showAll = () => {
    for (const [{options}, plot] of charts) {
      [options.scales.y.min, options.scales.y.max] = plot.range;
      if (plot.right) [options.scales.y2.min, options.scales.y2.max] = plot.right_range;
    }
    showTogether([first, last]);
  };

  let card;
  const boxes = plots.map((plot, i) => {
    const box = Make('section', '', {className: plot.below ? 'below' : 'card'});
    box.dataset.plot = i;
    if (plot.below) card.append(box); else card = box;
    Add(box, Add(Make('h3'), ...(plot.panel ? [Make('span', 'Figure ' + plot.panel, {className: 'panel'}), ' '] : []), plot.title + ' ',
      Make('span', '', {className: 'soft number time'})), Make('div', '', {className: 'keys'}), Make('div', '', {className: 'plot'}));
    if (plot.note) Add(box, Add(Make('p', '', {className: 'soft'}), Make('small', plot.note)));
    return box;
  });
  const Grid = (group, answers) => Add(Make('div', '', {className: 'grid'}),
    ...boxes.filter((box, i) => plots[i].times === group.times && !plots[i].below && plots[i].answers === answers));
  const whole = Make('button', 'Show the whole run', {type: 'button', onclick: () => showAll()});
  Add(document.getElementById('plots'), Make('h2', 'Plots'), Add(Make('div', '', {className: 'tools'}), whole, Make('span',
    'Drag to zoom (all plots follow), Shift-drag to move, double-click for the whole run; on a touch screen use two fingers. Names ' +
    'switch curves on and off.', {className: 'soft'})), ...groups.flatMap(group => [
    ...(group.title ? [Make('h3', group.title, {className: 'group'})] : []),
    ...(plots.some(plot => plot.answers) ? [Grid(group, true), Add(Make('details', '', {className: 'more'}), Make('summary', 'All other plots'),
      Grid(group, false))] : [Grid(group, false)])]));
  const watcher = new IntersectionObserver(entries => {
    for (const entry of entries) {
      if (!entry.isIntersecting || entry.target.chart) continue;
      watcher.unobserve(entry.target);
      draw(entry.target, plots[Number(entry.target.dataset.plot)]);
    }
  }, {rootMargin: '400px'});
  for (const box of boxes) watcher.observe(box);
  addEventListener('beforeprint', () => {
    for (const fold of document.querySelectorAll('.more')) fold.open = true;
    for (const box of boxes) if (!box.chart) draw(box, plots[Number(box.dataset.plot)]);
  });
  for (const button of document.querySelectorAll('[data-time]')) {
    button.addEventListener('click', () => {
      clock.set(Number(button.dataset.time));
      (document.getElementById('replay') || document.getElementById('plots')).scrollIntoView();
    });
  }
  const unfold = () => {
    const named = location.hash.length > 1 && document.getElementById(location.hash.slice(1));
    if (named && named.tagName === 'DETAILS') named.open = true;
  };
  addEventListener('hashchange', unfold);
  unfold();
  dark.addEventListener('change', () => {
    SetColors();
    for (const chart of charts.keys()) chart.update();
  });
})();
