// The study's trials to look at: any two quantities, all keys, a table; each place leads to its trial.
'use strict';
(() => {
  const source = document.getElementById('study-data');
  if (!source) return;
  const study = JSON.parse(source.textContent);
  const bytes = Uint8Array.from(atob(document.getElementById('study-values').textContent), c => c.charCodeAt(0));
  const numbers = new Float64Array(bytes.buffer);
  const width = study.columns.length;
  const count = numbers.length / width;
  const value = (row, column) => numbers[row * width + column];
  const kNumber = 0, kSeed = 1, kOutcome = 2, kFirstKey = 3;
  const firstMetric = kFirstKey + study.keys.length;
  const columns = study.columns;
  const find = name => columns.findIndex(column => column.name === name);
  const byId = id => document.getElementById('explore-' + id);
  const {style, Ticks, FormatTick, Begin, DrawAxes, Viridis, Ranks, Correlation, FindFront, Quote} = MakeChartTools(columns, byId);
  const held = row => study.held[value(row, kOutcome)];

  const show = (x, column) => {
    const labels = columns[column].labels;
    if (labels) return labels[x] ?? '–';
    if (column === kOutcome) return study.outcomes[x];
    if (!Number.isFinite(x)) return '–';
    return column <= kSeed ? String(x) : String(Number(x.toPrecision(5)));
  };

  // What is shown: rows that pass the filters.
  let chosen = -1;
  let rows = [];
  const brushes = new Map();  // column: [least, most]
  const Filter = () => {
    const outcome = byId('outcome').value;
    const text = byId('filter').value;
    const tests = [];
    for (const part of text.split(',')) {
      const match = part.match(/^\s*([\w.[\]]+)\s*(<=|>=|<|>|=)\s*(\S+)\s*$/);
      if (!match) continue;
      const column = find(match[1]);
      if (column < 0) continue;
      const label = columns[column].labels ? columns[column].labels.indexOf(match[3]) : -1;
      const limit = label >= 0 ? label : Number(match[3]);
      const signs = {'<': x => x < limit, '<=': x => x <= limit, '>': x => x > limit, '>=': x => x >= limit,
        '=': x => x === limit};
      tests.push(row => signs[match[2]](value(row, column)));
    }
    for (const [column, [least, most]] of brushes) {
      tests.push(row => value(row, column) >= least && value(row, column) <= most);
    }
    rows = [];
    for (let row = 0; row < count; ++row) {
      if (outcome !== '' && value(row, kOutcome) !== Number(outcome)) continue;
      if (tests.every(test => test(row))) rows.push(row);
    }
    byId('count').textContent = rows.length + ' of ' + count + ' trials' +
      (study.total > count ? ', a part of ' + study.total : '');
  };

  // Axes: a logarithm where a quantity spans decades. Of what else is drawn it has room for what is near the trials.
  const MakeAxis = (column, from, to, beside = []) => {
    let least = Infinity, most = -Infinity;
    for (const row of rows) {
      const x = value(row, column);
      if (!Number.isFinite(x)) continue;
      if (x < least) least = x;
      if (x > most) most = x;
    }
    const near = beside.filter(x => x > least / 3 && x < 3 * most);
    least = Math.min(least, ...near);
    most = Math.max(most, ...near);
    if (!(least <= most)) { least = 0; most = 1; }
    const log = !columns[column].labels && least > 0 && most / least > 30;
    const f = log ? Math.log10 : x => x;
    const low = f(least), high = f(most), room = high > low ? 0.04 * (high - low) : 0.5;
    const place = x => from + (f(x) - low + room) / (high - low + 2 * room) * (to - from);
    const back = at => {
      const y = low - room + (at - from) / (to - from) * (high - low + 2 * room);
      return log ? 10 ** y : y;
    };
    return {column, least, most, log, place, back};
  };
  const ColorBy = column => {
    if (column === kOutcome) return row => study.colors[value(row, kOutcome)];
    const axis = MakeAxis(column, 0, 1);
    return row => Number.isFinite(value(row, column)) ? Viridis(Math.min(Math.max(axis.place(value(row, column)), 0), 1)) : '#bbb';
  };

  // What (57) says: where its error dynamics turn unstable (a line), or overshoot (dashes).
  const theory = study.theory;
  const Stroke = (g, isStability, draw) => {
    g.save();
    g.strokeStyle = style('--ink') || '#222';
    g.lineWidth = 1.6;
    g.setLineDash(isStability ? [] : [5, 4]);
    g.beginPath();
    draw();
    g.stroke();
    g.restore();
  };
  const DrawTheory = (g, w, h, x, y, id) => {
    const kx = x.column - kFirstKey, ky = y.column - kFirstKey;
    const isKey = k => k >= 0 && k < study.keys.length;
    const kinds = new Set();
    g.save();
    g.beginPath();
    g.rect(60, 10, w - 70, h - 50);
    g.clip();
    if (isKey(kx) && isKey(ky)) {
      for (const curve of theory.curves) {
        const turned = curve.x === ky && curve.y === kx;
        if (!turned && !(curve.x === kx && curve.y === ky)) continue;
        kinds.add(curve.stability);
        // A key may turn more than once: the points are dots, and a line only where the next one is near.
        Stroke(g, curve.stability, () => {
          let last = null;
          for (const point of curve.points) {
            const [a, b] = turned ? [point[1], point[0]] : point;
            const px = x.place(a), py = y.place(b);
            const near = last && Math.hypot(px - last[0], py - last[1]) < 0.25 * Math.max(w, h);
            g[near ? 'lineTo' : 'moveTo'](px, py);
            last = [px, py];
          }
        });
      }
    } else {
      for (const [k, axis] of [[kx, x], [ky, y]]) {
        if (!isKey(k)) continue;
        for (const turn of theory.turns.filter(turn => turn.key === k)) {
          kinds.add(turn.stability);
          const at = axis.place(turn.value);
          Stroke(g, turn.stability, () => {
            g.moveTo(axis === x ? at : 60, axis === x ? 10 : at);
            g.lineTo(axis === x ? at : w - 10, axis === x ? h - 40 : at);
          });
        }
      }
    }
    g.restore();
    const names = [...kinds].sort().reverse().map(kind =>
      kind ? 'line: where the error dynamics (57) turn unstable' : 'dashes: where they are damped critically');
    byId(id).textContent = names.length ? 'Theory, ' + names.join('; ') + '; other keys as in ' + theory.place + '.' : '';
  };

  // What (57) makes of metrics: a curve along a key, the front of two of them. A point may have no value.
  const Predict = (x, y) => {
    const predicted = theory.predicted;
    if (!predicted) return null;
    const mx = predicted.metrics.indexOf(columns[x].name), my = predicted.metrics.indexOf(columns[y].name);
    if (mx >= 0 && my >= 0) {
      const points = predicted.sampled.map(v => [v[mx], v[my]]).filter(point => point.every(Number.isFinite));
      return {points: FindFront(points, ([a]) => a, ([, b]) => b, x, y),
        name: 'the Pareto front of the error dynamics (57), over ' + predicted.sampled.length + ' points of the ranges'};
    }
    const turned = my < 0, metric = turned ? mx : my;
    const along = predicted.along.find(a => a.key === (turned ? y : x) - kFirstKey);
    if (metric < 0 || !along) return null;
    const points = along.values.map((v, i) => turned ? [along.metrics[i][metric], v] : [v, along.metrics[i][metric]]);
    return {points, name: 'what the error dynamics (57) make of it, other keys as in ' + theory.place};
  };
  const DrawPrediction = (g, w, h, x, y, prediction) => {
    if (!prediction) return;
    g.save();
    g.beginPath();
    g.rect(60, 10, w - 70, h - 50);
    g.clip();
    g.strokeStyle = '#005f73';
    g.lineWidth = 2;
    g.setLineDash([2, 3]);
    g.beginPath();
    let open = false;
    for (const point of prediction.points) {
      const known = point.every(Number.isFinite);
      if (known) g[open ? 'lineTo' : 'moveTo'](x.place(point[0]), y.place(point[1]));
      open = known;
    }
    g.stroke();
    g.restore();
    byId('theory').textContent += (byId('theory').textContent ? ' D' : 'Theory, d') + 'ots: ' + prediction.name + '.';
  };

  // Places that can be chosen, by canvas.
  const places = {};
  const DrawScatter = () => {
    const {g, w, h} = Begin('scatter');
    const prediction = Predict(Number(byId('x').value), Number(byId('y').value));
    const x = MakeAxis(Number(byId('x').value), 60, w - 10, prediction?.points.map(point => point[0]));
    const y = MakeAxis(Number(byId('y').value), h - 40, 10, prediction?.points.map(point => point[1]));
    DrawAxes(g, w, h, x, y);
    const color = ColorBy(Number(byId('color').value));
    const points = [];
    for (const row of rows) {
      const px = x.place(value(row, x.column)), py = y.place(value(row, y.column));
      if (!Number.isFinite(px) || !Number.isFinite(py)) continue;
      points.push([px, py, row]);
      g.fillStyle = color(row);
      g.fillRect(px - 2, py - 2, 4, 4);
    }
    places.scatter = points;
    // Of two metrics: what no other held trial beats in both.
    const isFront = x.column >= firstMetric && y.column >= firstMetric;
    byId('front').textContent = '';
    if (isFront) {
      const good = rows.filter(row => held(row) && Number.isFinite(value(row, x.column)) && Number.isFinite(value(row, y.column)));
      const front = FindFront(good, row => value(row, x.column), row => value(row, y.column), x.column, y.column);
      g.strokeStyle = '#9b2226';
      g.lineWidth = 1.5;
      g.beginPath();
      front.forEach((row, i) => g[i ? 'lineTo' : 'moveTo'](x.place(value(row, x.column)), y.place(value(row, y.column))));
      g.stroke();
      byId('front').textContent = 'Pareto front: ' + front.length + ' trials';
    }
    DrawTheory(g, w, h, x, y, 'theory');
    DrawPrediction(g, w, h, x, y, prediction);
    Mark(g, points);
  };
  const Mark = (g, points) => {
    const point = points.find(([, , row]) => row === chosen);
    if (!point) return;
    g.strokeStyle = style('--accent') || '#06c';
    g.lineWidth = 2;
    g.beginPath();
    g.arc(point[0], point[1], 7, 0, 2 * Math.PI);
    g.stroke();
  };

  // The mean of a quantity over the ranges of two keys, in cells as wide as there are trials for.
  const DrawContour = () => {
    if (study.keys.length < 2) return;
    const {g, w, h} = Begin('contour');
    const x = MakeAxis(Number(byId('cx').value), 60, w - 10);
    const y = MakeAxis(Number(byId('cy').value), h - 40, 10);
    const z = Number(byId('cz').value);
    const n = Math.max(2, Math.min(40, Math.floor(Math.sqrt(rows.length / 2))));
    const sums = new Map();
    for (const row of rows) {
      const v = value(row, z);
      if (!held(row) || !Number.isFinite(v)) continue;
      const i = Math.floor((x.place(value(row, x.column)) - 60) / (w - 70) * n);
      const j = Math.floor((y.place(value(row, y.column)) - 10) / (h - 50) * n);
      const cell = sums.get(i + n * j) ?? [0, 0, row];
      cell[0] += v;
      ++cell[1];
      sums.set(i + n * j, cell);
    }
    const means = [...sums.values()].map(cell => cell[0] / cell[1]);
    const least = means.reduce((a, b) => Math.min(a, b), Infinity), most = means.reduce((a, b) => Math.max(a, b), -Infinity);
    const log = least > 0 && most / least > 30;
    const f = log ? Math.log : v => v;
    const points = [];
    for (const [key, [sum, number, row]] of sums) {
      const i = key % n, j = Math.floor(key / n);
      const share = most > least ? (f(sum / number) - f(least)) / (f(most) - f(least)) : 0;
      g.fillStyle = Viridis(share);
      const cw = (w - 70) / n, ch = (h - 50) / n;
      g.fillRect(60 + i * cw, 10 + j * ch, cw + 0.5, ch + 0.5);
      points.push([60 + (i + 0.5) * cw, 10 + (j + 0.5) * ch, row]);
    }
    places.contour = points;
    g.fillStyle = style('--ink') || '#222';
    DrawAxes(g, w, h, x, y);
    byId('range').textContent = means.length ? 'mean from ' + Number(least.toPrecision(3)) + ' to ' + Number(most.toPrecision(3)) : '';
    DrawTheory(g, w, h, x, y, 'theory-over');
    Mark(g, points);
  };

  // All keys and the chosen quantity side by side; a line for each trial. A drag along an axis keeps what it covers.
  let parallel = [];
  const DrawParallel = () => {
    const {g, w, h} = Begin('parallel');
    const shown = [...study.keys.keys()].map(i => kFirstKey + i).slice(0, 12).concat(Number(byId('y').value));
    const bottom = h - 66, left = 96;
    parallel = shown.map((column, i) =>
      ({...MakeAxis(column, bottom, 24), at: left + (w - left - 24) * i / (shown.length - 1)}));
    const color = ColorBy(Number(byId('color').value));
    const every = Math.max(1, Math.ceil(rows.length / 1500));
    g.globalAlpha = Math.max(0.15, Math.min(1, 60 / rows.length));
    const Line = row => {
      g.beginPath();
      parallel.forEach((axis, i) => {
        const at = axis.place(value(row, axis.column));
        if (Number.isFinite(at)) g[i ? 'lineTo' : 'moveTo'](axis.at, at);
      });
      g.stroke();
    };
    for (let i = 0; i < rows.length; i += every) {
      g.strokeStyle = color(rows[i]);
      Line(rows[i]);
    }
    g.globalAlpha = 1;
    if (chosen >= 0) {
      g.strokeStyle = style('--accent') || '#06c';
      g.lineWidth = 2.5;
      Line(chosen);
      g.lineWidth = 1;
    }
    g.textAlign = 'center';
    parallel.forEach((axis, i) => {
      g.strokeStyle = style('--soft') || '#888';
      g.beginPath();
      g.moveTo(axis.at, 24);
      g.lineTo(axis.at, bottom);
      g.stroke();
      g.fillStyle = style('--ink') || '#222';
      // Slanted, so that many names fit; without the section that most keys share.
      g.save();
      g.translate(axis.at + 4, bottom + 12);
      g.rotate(-0.55);
      g.textAlign = 'right';
      g.fillText(columns[axis.column].name.replace(/^[^.]*\./, '').slice(-20), 0, 0);
      g.restore();
      g.fillText(FormatTick(axis.most, axis.column), axis.at, 18);
      for (const turn of theory.turns.filter(turn => turn.key === axis.column - kFirstKey)) {
        const at = axis.place(turn.value);
        if (at >= 24 && at <= bottom) Stroke(g, turn.stability, () => { g.moveTo(axis.at - 9, at); g.lineTo(axis.at + 9, at); });
      }
      if (brushes.has(axis.column)) {
        const [least, most] = brushes.get(axis.column).map(axis.place);
        g.fillStyle = style('--accent') || '#06c';
        g.globalAlpha = 0.35;
        g.fillRect(axis.at - 6, Math.min(least, most), 12, Math.abs(most - least));
        g.globalAlpha = 1;
      }
    });
  };

  byId('theory-beside').textContent = theory.turns.length ? ' Bars across an axis: where (57) turns, as in the charts above.' : '';

  // The value of each point of a search, and the best until then.
  const DrawHistory = () => {
    if (!study.history) return;
    const {g, w, h} = Begin('history');
    const points = study.history;
    const finite = points.filter(p => p.feasible);
    const values = finite.flatMap(p => p.theory === undefined ? [p.value] : [p.value, p.theory]);
    if (theory.least !== undefined) values.push(theory.least);
    const least = values.reduce((a, b) => Math.min(a, b), Infinity), most = values.reduce((a, b) => Math.max(a, b), -Infinity);
    const log = least > 0 && most / least > 30;
    const f = log ? Math.log10 : v => v;
    const px = i => 60 + (w - 70) * (points.length > 1 ? i / (points.length - 1) : 0.5);
    const py = v => h - 40 - (h - 50) * (most > least ? (f(v) - f(least)) / (f(most) - f(least)) : 0.5);
    g.strokeRect(60, 10, w - 70, h - 50);
    g.textAlign = 'right';
    if (finite.length) for (const v of [least, most]) g.fillText(String(Number(v.toPrecision(3))), 56, py(v) + 4);
    g.textAlign = 'center';
    g.fillText('point 0 to ' + (points.length - 1) + (log ? ', values in their logarithm' : ''), 60 + (w - 70) / 2, h - 16);
    // In theory: a ring for each point, and the best that there can be.
    g.save();
    g.strokeStyle = '#005f73';
    for (const [i, p] of points.entries()) {
      if (!p.feasible || p.theory === undefined) continue;
      g.beginPath();
      g.arc(px(i), py(p.theory), 3.5, 0, 2 * Math.PI);
      g.stroke();
    }
    if (theory.least !== undefined) {
      g.lineWidth = 1.6;
      g.setLineDash([5, 4]);
      g.beginPath();
      g.moveTo(60, py(theory.least));
      g.lineTo(w - 10, py(theory.least));
      g.stroke();
      byId('theory-best').textContent = ' Theory: rings, what the error dynamics (57) make of each point; dashes, the best ' +
        'that they have within the ranges, ' + Number(theory.least.toPrecision(3)) + ', whatever the constraints.';
    }
    g.restore();
    let best = null;
    g.fillStyle = '#9aa';
    const line = [];
    points.forEach((p, i) => {
      if (!p.feasible) { g.fillRect(px(i) - 1, 14, 2, 5); return; }
      g.fillRect(px(i) - 2, py(p.value) - 2, 4, 4);
      if (best === null || (study.maximize ? p.value > best : p.value < best)) best = p.value;
      line.push([px(i), py(best)]);
    });
    g.strokeStyle = style('--accent') || '#06c';
    g.lineWidth = 2;
    g.beginPath();
    line.forEach(([a, b], i) => g[i ? 'lineTo' : 'moveTo'](a, b));
    g.stroke();
  };

  // How a quantity goes with each key: the correlation of ranks.
  const DrawImportance = () => {
    const column = Number(byId('y').value);
    const good = rows.filter(row => held(row) && Number.isFinite(value(row, column)));
    const ranks = Ranks(good.map(row => value(row, column)));
    const list = study.keys.map((key, i) =>
      [key, good.length > 2 ? Correlation(Ranks(good.map(row => value(row, kFirstKey + i))), ranks) : 0]);
    list.sort((a, b) => Math.abs(b[1]) - Math.abs(a[1]));
    byId('importance').replaceChildren(...list.map(([key, r]) => {
      const tr = document.createElement('tr');
      const name = document.createElement('td'), bar = document.createElement('td'), number = document.createElement('td');
      name.textContent = key + (theory.knows[study.keys.indexOf(key)] ? ' (57)' : '');
      const div = document.createElement('div');
      div.className = 'bar';
      div.style.width = (8 * Math.abs(r)).toFixed(2) + 'rem';
      bar.append(div);
      number.textContent = r.toFixed(2);
      number.className = 'value number';
      tr.append(name, bar, number);
      return tr;
    }));
    byId('importance-of').textContent = columns[column].label;
  };

  // The table: as many as one can read, sorted by any column.
  let sorted = {column: kNumber, down: false};
  const shownColumns = [...columns.keys()].filter(i => i !== kSeed || study.seeds > 1);
  const DrawTable = () => {
    const list = [...rows].sort((a, b) => {
      const x = value(a, sorted.column), y = value(b, sorted.column);
      if (!Number.isFinite(x) || !Number.isFinite(y)) return Number.isFinite(y) - Number.isFinite(x);
      return sorted.down ? y - x : x - y;
    }).slice(0, 50);
    byId('head').replaceChildren(...shownColumns.map(column => {
      const th = document.createElement('th');
      th.textContent = columns[column].name;
      if (sorted.column === column) th.setAttribute('aria-sort', sorted.down ? 'descending' : 'ascending');
      th.onclick = () => {
        sorted = {column, down: sorted.column === column && !sorted.down};
        DrawTable();
      };
      return th;
    }));
    byId('body').replaceChildren(...list.map(row => {
      const tr = document.createElement('tr');
      tr.className = row === chosen ? 'chosen' : '';
      for (const column of shownColumns) {
        const td = document.createElement('td');
        td.textContent = show(value(row, column), column);
        td.className = 'number';
        tr.append(td);
      }
      tr.onclick = () => Choose(row);
      return tr;
    }));
  };

  const ListSettings = row => study.overrides.concat(study.keys.map((key, i) => {
    const labels = columns[kFirstKey + i].labels, x = value(row, kFirstKey + i);
    return key + '=' + (labels ? labels[x] : String(x));
  })).map(setting => ' --set ' + Quote(setting)).join('');
  const Choose = row => {
    chosen = row;
    byId('chosen').hidden = row < 0;
    if (row >= 0) {
      const seed = value(row, kSeed);
      const end = (seed ? ' --seed ' + seed : '') + (study.check ? '' : ' --no-check');
      byId('which').textContent = 'Trial ' + value(row, kNumber) + ': ' + study.outcomes[value(row, kOutcome)];
      byId('numbers').textContent = columns.slice(kFirstKey).map((column, i) =>
        column.name + ' ' + show(value(row, kFirstKey + i), kFirstKey + i)).join('; ');
      byId('command').textContent = 'dexcheck run ' + Quote(study.scenario) + ListSettings(row) + end +
        ' --video --out trial-' + value(row, kNumber);
      byId('budget').textContent = 'dexcheck budget ' + Quote(study.scenario) + ListSettings(row);
    }
    DrawScatter();
    DrawContour();
    DrawParallel();
    DrawTable();
  };

  const Draw = () => {
    Filter();
    DrawHistory();
    DrawScatter();
    DrawContour();
    DrawParallel();
    DrawImportance();
    DrawTable();
  };
  const Fill = (id, from, to, start) => {
    for (let i = from; i < to; ++i) byId(id).append(new Option(columns[i].label, i));
    byId(id).value = start;
    byId(id).onchange = Draw;
  };
  const shown = study.shown.length ? study.shown.map(find) : [firstMetric];
  Fill('x', kFirstKey, width, kFirstKey);
  Fill('y', firstMetric, width, shown[0]);
  Fill('color', kOutcome, width, kOutcome);
  if (study.keys.length > 1) {
    Fill('cx', kFirstKey, firstMetric, kFirstKey);
    Fill('cy', kFirstKey, firstMetric, kFirstKey + 1);
    Fill('cz', firstMetric, width, shown[0]);
  }
  byId('outcome').append(new Option('any outcome', ''));
  study.outcomes.forEach((name, i) => byId('outcome').append(new Option(name, i)));
  byId('outcome').onchange = Draw;
  byId('filter').oninput = Draw;

  const Nearest = (id, event) => {
    const box = byId(id).getBoundingClientRect();
    const x = event.clientX - box.x, y = event.clientY - box.y;
    let best = -1, least = 20 ** 2;
    for (const [px, py, row] of places[id] ?? []) {
      const square = (px - x) ** 2 + (py - y) ** 2;
      if (square < least) { least = square; best = row; }
    }
    return best;
  };
  for (const id of ['scatter', 'contour']) {
    if (!byId(id)) continue;  // a study of one key
    byId(id).onclick = event => { const row = Nearest(id, event); if (row >= 0) Choose(row); };
  }
  let begun = null;
  byId('parallel').onpointerdown = event => {
    const box = byId('parallel').getBoundingClientRect();
    const x = event.clientX - box.x;
    const axis = parallel.reduce((a, b) => Math.abs(b.at - x) < Math.abs(a.at - x) ? b : a);
    begun = {axis, y: event.clientY - box.y};
  };
  byId('parallel').onpointerup = event => {
    if (!begun) return;
    const y = event.clientY - byId('parallel').getBoundingClientRect().y;
    const ends = [begun.axis.back(begun.y), begun.axis.back(y)].sort((a, b) => a - b);
    if (Math.abs(y - begun.y) < 4) brushes.delete(begun.axis.column);
    else brushes.set(begun.axis.column, ends);
    begun = null;
    Draw();
  };
  let waiting = 0;
  addEventListener('resize', () => { clearTimeout(waiting); waiting = setTimeout(Draw, 100); });
  Draw();
  document.getElementById('explore').dataset.ready = 'yes';
})();
