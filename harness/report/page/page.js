// The report's plots: zoomed together, drawn when they come into view.
(() => {
  'use strict';
  const run = ReadJson('run-plots');
  const numbers = new Float32Array(ReadBytes('run-values'));
  const count = run.points;
  const dark = matchMedia('(prefers-color-scheme: dark)');
  const first = run.times[0];
  const last = Math.max(run.times[count - 1], first + 1e-6);
  const plots = [];
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
  const findRow = time => {
    let low = 0;
    let high = count - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (run.times[middle] <= time) low = middle; else high = middle;
    }
    return time - run.times[low] <= run.times[high] - time ? low : high;
  };

  const format = value => {
    if (!Number.isFinite(value)) return '–';
    if (value === 0) return '0';
    const size = Math.abs(value);
    return size < 1e-3 || size >= 1e5 ? value.toExponential(2) : String(Number(value.toPrecision(5)));
  };

  /** Rows [t, series...] of a plot; what cannot be drawn is null. */
  const makeRows = plot => {
    const rows = new Array(count);
    for (let i = 0; i < count; ++i) {
      const row = [run.times[i]];
      for (const curve of plot.curves) {
        const value = numbers[curve.series * count + i];
        row.push(Number.isFinite(value) && !(plot.log && value <= 0) ? value : null);
      }
      rows[i] = row;
    }
    return rows;
  };

  const showTogether = range => {
    shown = range;
    for (const plot of plots) {
      const window = plot.xAxisRange();
      if (window[0] !== range[0] || window[1] !== range[1]) plot.updateOptions({dateWindow: range});
    }
  };

  const drawBound = plot => (context, area, graph) => {
    if (plot.bound === null) return;
    const y = graph.toDomYCoord(plot.bound);
    if (!(y >= area.y && y <= area.y + area.h)) return;
    context.save();
    context.strokeStyle = dark.matches ? '#ff8f85' : '#c02020';
    context.setLineDash([8, 5]);
    context.beginPath();
    context.moveTo(area.x, y);
    context.lineTo(area.x + area.w, y);
    context.stroke();
    context.restore();
  };

  /** Ticks of a logarithmic axis: powers of ten, at most one for each 28 pixels; below two decades, 2 and 5 too. */
  const tickDecades = (low, high, pixels) => {
    const from = Math.ceil(Math.log10(low) - 1e-9);
    const to = Math.floor(Math.log10(high) + 1e-9);
    const stride = Math.max(1, Math.ceil((to - from + 1) * 28 / pixels));
    const ticks = [];
    for (let decade = from - 1; decade <= to; ++decade) {
      for (const digit of to - from < 2 ? [1, 2, 5] : [1]) {
        const value = digit * 10 ** decade;
        if (value < low || value > high || decade % stride !== 0) continue;
        ticks.push({v: value, label: decade < -2 || decade > 3 ? `${digit}e${decade}` : format(value)});
      }
    }
    return ticks;
  };

  /** One finger scrolls the page; two fingers zoom the plot. */
  const makeInteraction = () => {
    const model = Object.assign({}, Dygraph.defaultInteractionModel);
    const pinch = model.touchstart;
    model.touchstart = (event, graph, context) => {
      if (event.touches.length > 1) pinch(event, graph, context);
    };
    model.dblclick = () => showAll();
    return model;
  };

  const makeKeys = (plot, box, getGraph) => plot.curves.map((curve, k) => {
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
      const visible = !getGraph().visibility()[k];
      getGraph().setVisibility(k, visible);
      key.setAttribute('aria-pressed', String(visible));
    });
    box.append(key);
    return value;
  });

  const draw = (box, plot) => {
    const rows = makeRows(plot);
    const series = {};
    plot.curves.forEach(curve => {
      series[curve.id] = {
        axis: curve.right ? 'y2' : 'y',
        color: curve.color + (curve.wide ? '66' : ''),
        strokePattern: curve.dashes.length > 0 ? curve.dashes : null,
        strokeWidth: curve.wide ? 6 : curve.background ? 0.8 : 1.5,
      };
    });
    let graph = null;
    const values = makeKeys(plot, box.querySelector('.keys'), () => graph);
    const ranges = [plot.range, plot.right_range ?? null];
    const formatAxis = value => format(Number(value.toPrecision(4)));
    const axis = {axisLabelFormatter: formatAxis, axisLabelWidth: 62};
    if (plot.log) axis.ticker = tickDecades;
    graph = new Dygraph(box.querySelector('.plot'), rows, {
      labels: ['t'].concat(plot.curves.map(curve => curve.id)),
      series,
      axes: {
        x: {axisLabelFormatter: formatAxis},
        y: Object.assign({valueRange: ranges[0]}, axis),
        y2: Object.assign({valueRange: ranges[1], independentTicks: true, drawGrid: false}, axis),
      },
      logscale: plot.log,
      xlabel: 't (s)',
      ylabel: plot.label,
      y2label: plot.right || null,
      dateWindow: shown,
      legend: 'never',
      gridLineColor: dark.matches ? '#313a43' : '#e3e7eb',
      axisLineColor: dark.matches ? '#55616c' : '#9aa3ad',
      interactionModel: makeInteraction(),
      underlayCallback: drawBound(plot),
      highlightCallback: (event, t) => {
        if (event && !clock.isPlaying()) clock.set(t);
      },
      clickCallback: (event, t) => clock.set(t),
      drawCallback: (drawn, initial) => {
        if (initial) return;
        placeLine();
        const window = drawn.xAxisRange();
        if (window[0] !== shown[0] || window[1] !== shown[1]) showTogether(window);
      },
    });
    const line = document.createElement('i');
    line.className = 'now';
    box.querySelector('.plot').append(line);
    const placeLine = () => {
      const area = graph.getArea();
      const x = graph.toDomXCoord(clock.time);
      line.hidden = !(x >= area.x && x <= area.x + area.w);
      line.style.cssText = `left: ${x}px; top: ${area.y}px; height: ${area.h}px`;
    };
    const showValues = () => {
      placeLine();
      const row = findRow(clock.time);
      values.forEach((value, k) => { value.textContent = format(rows[row][k + 1] ?? NaN); });
      box.querySelector('.time').textContent = `t = ${run.times[row].toFixed(3)} s`;
    };
    clock.listeners.push(showValues);
    showValues();
    box.graph = graph;
    box.ranges = ranges;
    plots.push(graph);
  };

  const showAll = () => {
    showTogether([first, last]);
    for (const box of boxes) {
      if (!box.graph) continue;
      box.graph.updateOptions({axes: {y: {valueRange: box.ranges[0]}, y2: {valueRange: box.ranges[1]}}});
    }
  };

  const boxes = run.plots.map((plot, i) => {
    const box = Make('section', '', {className: 'card'});
    box.dataset.plot = i;
    Add(box, Add(Make('h3'), ...(plot.panel ? [Make('span', 'Figure ' + plot.panel, {className: 'panel'}), ' '] : []), plot.title + ' ',
      Make('span', '', {className: 'soft number time'})), Make('div', '', {className: 'keys'}), Make('div', '', {className: 'plot'}));
    if (plot.note) Add(box, Add(Make('p', '', {className: 'soft'}), Make('small', plot.note)));
    return box;
  });
  const whole = Make('button', 'Show the whole run', {type: 'button', onclick: () => showAll()});
  Add(document.getElementById('plots'), Make('h2', 'Plots'), Add(Make('div', '', {className: 'tools'}), whole, Make('span',
    'Drag to zoom (all plots follow), Shift-drag to move, double-click for the whole run; on a touch screen use two fingers. Names ' +
    'switch curves on and off.', {className: 'soft'})), Add(Make('div', '', {className: 'grid'}), ...boxes));
  const watcher = new IntersectionObserver(entries => {
    for (const entry of entries) {
      if (!entry.isIntersecting || entry.target.graph) continue;
      watcher.unobserve(entry.target);
      draw(entry.target, run.plots[Number(entry.target.dataset.plot)]);
    }
  }, {rootMargin: '400px'});
  for (const box of boxes) watcher.observe(box);
  addEventListener('beforeprint', () => {
    for (const box of boxes) if (!box.graph) draw(box, run.plots[Number(box.dataset.plot)]);
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
    for (const plot of plots) {
      plot.updateOptions({gridLineColor: dark.matches ? '#313a43' : '#e3e7eb'});
    }
  });
})();
