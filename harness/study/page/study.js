// A study's page: its findings, tables and charts, each place of which leads to its trial.
'use strict';
(() => {
  const study = ReadJson('study-data');
  const numbers = new Float64Array(ReadBytes('study-values'));
  const {style, Short, IsWide, ColorOf, Bars, Scatter, Cells} = MakeCharts();
  const columns = study.columns, width = columns.length, count = numbers.length / width;
  const value = (row, column) => numbers[row * width + column];
  const kNumber = 0, kSeed = 1, kOutcome = 2, kFirstKey = 3, firstMetric = kFirstKey + study.keys.length;
  const drawn = count - study.added.length, isPart = study.done > drawn;
  const find = name => columns.findIndex(column => column.name === name);
  const get = id => document.getElementById(id), byId = id => get('explore-' + id);
  const held = row => study.outcomes[value(row, kOutcome)].held;
  // Rows of the best that the page's part of the trials lacks: they are marks, and count nowhere.
  const added = new Set(study.added), isAdded = row => added.has(value(row, kNumber));

  const Show = (x, column) => {
    const {labels} = columns[column];
    if (labels) return labels[x] ?? '–';
    if (column === kOutcome) return study.outcomes[x].name;
    return !Number.isFinite(x) ? '–' : column <= kSeed ? String(x) : String(Number(x.toPrecision(5)));
  };
  const ShowCell = cell => cell === null ? '–' : typeof cell === 'number' ? Short(cell) : cell;
  const Describe = row => row === undefined ? '' : ['trial ' + value(row, kNumber), ...study.keys.map((key, i) =>
    key + ' = ' + Show(value(row, kFirstKey + i), kFirstKey + i)), Show(value(row, kOutcome), kOutcome)].join(', ');
  const ShowTable = (heads, rows) => Table(heads, rows.map(row => row.map(cell => cell instanceof Node ? cell : ShowCell(cell))));
  const Link = number => Make('a', String(number), {href: '#trial-' + number});

  // What does not depend on a choice.
  const ShowSummary = () => {
    get('study-name').textContent = study.name;
    get('study-description').textContent = study.description ? ' – ' + study.description : '';
    const tracked = study.outcomes.find(o => o.name === 'tracked').count;
    for (const [number, text] of [
      [`${study.done} of ${study.is_search ? 'at most ' : ''}${study.total}`, `trials of scenario ${study.scenario} are done`],
      [tracked, 'tracked to their end, without slip']]) {
      Add(get('study-tiles'), Add(Make('div', '', {className: 'card'}), Make('b', String(number)), Make('span', text)));
    }
    Add(get('findings'), ...study.findings.map(finding => Make('p', finding)));
    if (study.gain_card) get('findings').after(GainCard(study.gain_card));
    const {dexcheck_version, git_revision, mujoco_version} = study.versions;
    get('study-footer').textContent = `dexcheck ${dexcheck_version}${git_revision ? ', revision ' + git_revision : ''}, MuJoCo ${mujoco_version}.`;
    Add(get('outcome-table'), ShowTable(['outcome', 'trials'], study.outcomes.filter(o => o.count > 0).map(o => [
      Add(Make('span'), Object.assign(Make('span', '', {className: 'key'}), {style: 'background:' + o.color}), ' ' + o.name), o.count])));
    if (study.best) {
      get('best').querySelector('p').textContent = study.best.order;
      if (study.best.rows.length) Add(get('best').querySelector('div'), ShowTable(['trial', ...study.best.heads],
        study.best.rows.map(row => [Link(row.trial), ...row.cells])));
    }
    for (const {quantity, keys} of study.sensitivity) {
      const canvas = Make('canvas', '', {role: 'img', ariaLabel: 'effects on ' + quantity});
      const what = 'moves it over its range by';
      Add(get('effects').querySelector('.grid'), Add(Make('section', '', {className: 'card scroll'}), Make('h3', quantity),
        Add(Make('div', '', {className: 'chart'}), canvas), ShowTable(['key', what, 'spread'], keys.map(k => [k.key, k.value, k.spread]))));
      Bars(canvas, {labels: keys.map(k => k.key), sets: [{label: what, values: keys.map(k => k.value), color: style('--accent')},
        {label: 'with 95 %', values: keys.map(k => [k.low, k.high]), color: style('--ink'), thin: true}]});
    }
  };

  // Rows that pass the filters.
  let chosen = -1, rows = [], marks = [];
  const Filter = () => {
    const outcome = byId('outcome').value, tests = [];
    for (const part of byId('filter').value.split(',')) {
      const match = part.match(/^\s*([\w.[\]]+)\s*(<=|>=|<|>|=)\s*(\S+)\s*$/);
      const column = match ? find(match[1]) : -1;
      if (column < 0) continue;
      const label = columns[column].labels ? columns[column].labels.indexOf(match[3]) : -1;
      const limit = label >= 0 ? label : Number(match[3]);
      const holds = {'<': x => x < limit, '<=': x => x <= limit, '>': x => x > limit, '>=': x => x >= limit, '=': x => x === limit}[match[2]];
      tests.push(row => holds(value(row, column)));
    }
    const passed = [...Array(count).keys()].filter(row => (outcome === '' || value(row, kOutcome) === Number(outcome)) && tests.every(test => test(row)));
    rows = passed.filter(row => !isAdded(row));
    marks = passed.filter(isAdded);
    byId('count').textContent = `${rows.length} of ${drawn} trials` + (isPart ? `, a part of ${study.done}` : '');
  };

  const Range = (list, column) => {
    let least = Infinity, most = -Infinity;
    for (const row of list) {
      const x = value(row, column);
      if (x < least) least = x;
      if (x > most) most = x;
    }
    return [least, most];
  };
  // Whether numbers of a key, sorted, are rather multiples of each other than evenly spaced.
  const IsGeometric = ([...at]) => {
    const least = at[0], most = at[at.length - 1], middle = Median(at);
    return least > 0 && most >= 3 * least &&
      Math.abs(Math.log(middle / least) / Math.log(most / least) - 0.5) < Math.abs((middle - least) / (most - least) - 0.5);
  };
  const ValuesOf = (list, column) => [...new Set(list.map(row => value(row, column)))].sort((a, b) => a - b);
  const AxisOf = (column, list = rows) => {
    const {label, labels} = columns[column];
    if (labels || column === kOutcome) return {label, labels: labels ?? study.outcomes.map(o => o.name)};
    if (column >= firstMetric || column < kFirstKey) return {label, log: IsWide(...Range(list, column))};
    const values = ValuesOf(list, column);
    return {label, log: IsGeometric(values), ticks: values.length < 8 ? values : undefined};
  };
  // Colours of numbers, pale to dark; those that differ by rounding have one.
  const ColorsOf = (least, most, none) => {
    const f = IsWide(least, most) ? Math.log : x => x, isFlat = !(most > least) || Short(least) === Short(most);
    return {isFlat, isLog: f === Math.log, of: x => !Number.isFinite(x) ? none : ColorOf(isFlat ? 0 : (f(x) - f(least)) / (f(most) - f(least)))};
  };
  const ColorBy = (column, list = rows) => {
    if (column === kOutcome) return row => study.outcomes[value(row, kOutcome)].color;
    const colors = ColorsOf(...Range(list, column), '#bbb');
    return row => colors.of(value(row, column));
  };
  // Of points, those that no other one beats in both quantities, by the first one.
  const FindFront = (list, x, y) => {
    const sx = columns[x].larger_is_better ? -1 : 1, sy = columns[y].larger_is_better ? -1 : 1;
    let best = Infinity;
    return list.sort((a, b) => sx * (value(a, x) - value(b, x)) || sy * (value(a, y) - value(b, y))).filter(row => {
      const better = sy * value(row, y) < best;
      if (better) best = sy * value(row, y);
      return better;
    });
  };
  const Median = list => {
    const sorted = [...list].sort((a, b) => a - b), half = sorted.length >> 1;
    return sorted.length % 2 ? sorted[half] : (sorted[half - 1] + sorted[half]) / 2;
  };
  const GroupBy = (list, key) => {
    const groups = new Map();
    for (const row of list) {
      if (!groups.has(key(row))) groups.set(key(row), []);
      groups.get(key(row)).push(row);
    }
    return groups;
  };

  const kMostDrawn = 6000;  // points of a chart, about
  // In [0, 1); a step through the rows would meet the same seed again and again.
  const Hash = row => {
    let x = Math.imul(row + 1, 0x9e3779b1);
    x = Math.imul(x ^ (x >>> 15), 0x85ebca6b);
    return ((x ^ (x >>> 13)) >>> 0) / 2 ** 32;
  };
  // Any quantity against another one, with the Pareto front of two metrics.
  const DrawPair = (canvas, x, y, color, list = rows, withMedian = false) => {
    const good = list.filter(row => Number.isFinite(value(row, x)) && Number.isFinite(value(row, y)));
    const seen = good.concat(marks.filter(row => Number.isFinite(value(row, x)) && Number.isFinite(value(row, y))));
    const colorOf = ColorBy(color, seen), part = kMostDrawn / seen.length;
    const At = row => ({x: value(row, x), y: value(row, y), row, color: colorOf(row)});
    const lines = [];
    if (x >= firstMetric && y >= firstMetric) {
      const front = FindFront(good.filter(held), x, y);
      lines.push({label: `Pareto front, ${front.length} trials`, points: front.map(At), color: '#9b2226'});
    } else if (withMedian && !columns[x].labels) {
      const groups = [...GroupBy(good.filter(held), row => value(row, x))].sort((a, b) => a[0] - b[0]);
      if (study.is_grid || good.length >= 2 * groups.length)
        lines.push({label: 'median', color: style('--accent'), points: groups.map(([at, group]) => ({x: at, y: Median(group.map(row => value(row, y)))}))});
    }
    Scatter(canvas, {x: AxisOf(x, seen), y: AxisOf(y, seen), points: seen.filter(row => Hash(row) < part || row === chosen || isAdded(row)).map(At), lines, chosen,
      choose: Choose, describe: p => Describe(p.row) + `; ${columns[y].name} ${Show(p.y, y)}`});
  };

  // Edges of cells along a key: between its values where these are few, else even ones.
  const EdgesOf = column => {
    const values = ValuesOf(rows, column), {log, labels} = AxisOf(column);
    const f = log ? Math.log : x => x, back = log ? Math.exp : x => x;
    if (values.length <= 200 && values.length * 4 <= rows.length * (study.is_grid ? 100 : 1)) {
      const at = values.map(f), gap = (i, j) => at[j] - at[i], last = at.length - 1;
      const inner = at.slice(1).map((v, i) => (v + at[i]) / 2), half = labels ? [0.5, 0.5] : last > 0 ? [gap(0, 1) / 2, gap(last - 1, last) / 2] : [0.5, 0.5];
      return [at[0] - half[0], ...inner, at[last] + half[1]].map(back);
    }
    const n = Math.max(2, Math.min(40, Math.floor(Math.sqrt(rows.length / 2)))), from = f(values[0]), to = f(values[values.length - 1]);
    return Array.from({length: n + 1}, (_, i) => back(from + (to - from) * i / n));
  };
  // Over two keys: the worst outcome of each cell, or the mean of a quantity over the trials that were held.
  const DrawMap = (canvas, x, y, z, text) => {
    if (!rows.length) return;
    const ex = EdgesOf(x), ey = EdgesOf(y);
    const Find = (edges, v) => Math.min(Math.max(edges.findIndex(edge => v < edge) - 1, v >= edges[edges.length - 1] ? edges.length - 2 : 0), edges.length - 2);
    const groups = GroupBy(rows, row => Find(ex, value(row, x)) + ex.length * Find(ey, value(row, y)));
    const worst = group => group.reduce((a, b) => held(b) < held(a) || (held(b) === held(a) && value(b, kOutcome) > value(a, kOutcome)) ? b : a);
    const mean = group => {
      const good = group.filter(row => held(row) && Number.isFinite(value(row, z)));
      return good.reduce((sum, row) => sum + value(row, z), 0) / good.length;
    };
    const cells = [...groups].map(([key, group]) => {
      const i = key % ex.length, j = Math.floor(key / ex.length), row = group.includes(chosen) ? chosen : worst(group);
      return {x: [ex[i], ex[i + 1]], y: [ey[j], ey[j + 1]], row, outcome: study.outcomes[value(worst(group), kOutcome)],
        z: z === kOutcome ? value(worst(group), kOutcome) : mean(group)};
    });
    const finite = cells.map(cell => cell.z).filter(Number.isFinite);
    const least = finite.reduce((a, b) => Math.min(a, b), Infinity), most = finite.reduce((a, b) => Math.max(a, b), -Infinity);
    const colors = ColorsOf(least, most);
    for (const cell of cells) cell.color = z === kOutcome ? cell.outcome.color : colors.of(cell.z) ?? cell.outcome.color;
    const unit = columns[z].label.split(', ')[1], AndUnit = x => Short(x) + (unit ? ' ' + unit : '');
    const others = finite.length < cells.length ? '; the other cells show their outcome' : '';
    Cells(canvas, {x: AxisOf(x), y: AxisOf(y), cells, chosen, choose: Choose, describe: p => Describe(p.row) + (z === kOutcome ? '' : `; ${columns[z].name} ${Show(p.z, z)}`)});
    text.textContent = z === kOutcome ? `The worst outcome of each cell${isPart ? ', of the trials on this page' : ''}.`
      : finite.length && colors.isFlat ? `${AndUnit(least)} everywhere.`
      : finite.length ? `From ${AndUnit(least)} (pale) to ${AndUnit(most)} (dark)${colors.isLog ? ', by the logarithm' : ''}${others}.` : 'No value.';
    return finite.length > 0 && !colors.isFlat;
  };

  const DrawHistory = () => {
    const good = study.history.map((p, i) => ({x: i, y: p.value, feasible: p.feasible, number: p.trial})).filter(p => p.feasible && p.y !== null);
    let best = null;
    const line = good.map(p => {
      if (best === null || (study.maximize ? p.y > best : p.y < best)) best = p.y;
      return {x: p.x, y: best};
    });
    const byNumber = new Map(rows.concat(marks).map(row => [value(row, kNumber), row]));
    const values = good.map(p => p.y);
    Scatter(byId('history'), {x: {label: 'point'}, y: {label: 'objective', log: IsWide(Math.min(...values), Math.max(...values))}, chosen, choose: Choose,
      points: good.map(p => ({...p, row: byNumber.get(p.number), color: '#8a9a9a'})), lines: [{label: 'best until then', points: line, color: style('--accent')}],
      describe: p => `point ${p.x}: ${Short(p.y)}`});
  };

  // How a quantity goes with each key: the correlation of ranks.
  const Ranks = values => {
    const order = values.map((v, i) => [v, i]).sort((a, b) => a[0] - b[0]), ranks = new Float64Array(values.length);
    for (let i = 0, j = 0; i < order.length; i = j) {
      while (j < order.length && order[j][0] === order[i][0]) ++j;
      for (let k = i; k < j; ++k) ranks[order[k][1]] = (i + j - 1) / 2;
    }
    return ranks;
  };
  const Correlation = (a, b) => {
    const mean = (a.length - 1) / 2, sum = (p, q) => p.reduce((s, v, i) => s + (v - mean) * (q[i] - mean), 0);
    return sum(a, a) > 0 && sum(b, b) > 0 ? sum(a, b) / Math.sqrt(sum(a, a) * sum(b, b)) : 0;
  };
  const DrawImportance = column => {
    const good = rows.filter(row => held(row) && Number.isFinite(value(row, column)));
    const ranks = Ranks(good.map(row => value(row, column)));
    const list = study.keys.map((key, i) => [key, good.length > 2 ? Correlation(Ranks(good.map(row => value(row, kFirstKey + i))), ranks) : 0]);
    list.sort((a, b) => Math.abs(b[1]) - Math.abs(a[1]));
    Bars(byId('importance'), {labels: list.map(([key]) => key), sets: [{label: 'correlation', values: list.map(([, r]) => r), color: style('--accent')}], least: -1, most: 1});
    byId('importance-of').textContent = columns[column].label;
  };

  // The table: as many as one can read, sorted by any column.
  let sorted = {column: kNumber, down: false};
  // Not those in which each trial has 0 or no value.
  const isUsed = [...columns.keys()].map(i => i === kSeed ? study.seeds > 1 : i < firstMetric || columns[i].name === study.error ||
    study.shown.includes(columns[i].name) || [...Array(count).keys()].some(row => value(row, i)));
  const tableColumns = [...columns.keys()].filter(i => isUsed[i]);
  const OnPress = (element, act) => Object.assign(element, {tabIndex: 0, onclick: act, onkeydown: event => {
    if (event.key === 'Enter' || event.key === ' ') { event.preventDefault(); act(); }
  }});
  const DrawTable = () => {
    const list = rows.concat(marks).sort((a, b) => {
      const x = value(a, sorted.column), y = value(b, sorted.column);
      if (!Number.isFinite(x) || !Number.isFinite(y)) return Number.isFinite(y) - Number.isFinite(x);
      return sorted.down ? y - x : x - y;
    }).slice(0, 50);
    byId('head').replaceChildren(...tableColumns.map(column => {
      const th = OnPress(Make('th', columns[column].label), () => {
        sorted = {column, down: sorted.column === column && !sorted.down};
        DrawTable();
        byId('head').children[tableColumns.indexOf(column)].focus();
      });
      if (sorted.column === column) th.setAttribute('aria-sort', sorted.down ? 'descending' : 'ascending');
      return th;
    }));
    byId('body').replaceChildren(...list.map(row => OnPress(Add(Make('tr', '', {className: row === chosen ? 'chosen' : ''}),
      ...tableColumns.map(column => Make('td', Show(value(row, column), column), {className: 'number'}))), () => Choose(row))));
  };

  // For a shell.
  const Quote = text => /^[\w.,:=+/-]+$/.test(text) ? text : "'" + text.replaceAll("'", "'\\''") + "'";
  const ListSettings = row => study.overrides.concat(study.keys.map((key, i) => {
    const {labels} = columns[kFirstKey + i], x = value(row, kFirstKey + i);
    return key + '=' + (labels ? labels[x] : String(x));
  })).map(setting => ' --set ' + Quote(setting)).join('');
  const ShowChosen = () => {
    byId('chosen').hidden = chosen < 0;
    if (chosen < 0) return;
    const seed = value(chosen, kSeed), number = value(chosen, kNumber), failure = study.failures[number];
    byId('which').textContent = `Trial ${number}: ${Show(value(chosen, kOutcome), kOutcome)}${failure ? ': ' + failure : ''}`;
    byId('numbers').textContent = columns.slice(kFirstKey).map((column, i) => column.name + ' ' + Show(value(chosen, kFirstKey + i), kFirstKey + i)).join('; ');
    byId('command').textContent = 'dexcheck run ' + Quote(study.scenario) + ListSettings(chosen) + (seed ? ' --seed ' + seed : '') +
      (study.check ? '' : ' --no-check') + ' --video --out trial-' + number;
    byId('budget').textContent = 'dexcheck budget ' + Quote(study.scenario) + ListSettings(chosen);
  };
  const Choose = row => {
    chosen = row;
    history.replaceState(null, '', '#trial-' + value(row, kNumber));
    Draw();
    byId('chosen').scrollIntoView({block: 'nearest'});
  };

  const Card = (parent, title) => {
    const canvas = Make('canvas', '', {role: 'img', ariaLabel: title}), text = Make('p', '', {className: 'soft'});
    Add(parent, Add(Make('section', '', {className: 'card'}), Make('h3', title), Add(Make('div', '', {className: 'chart'}), canvas), text));
    return {canvas, text};
  };
  const shown = study.shown.map(find), error = find(study.error), energy = find('energy');
  const maps = !study.is_grid || study.keys.length < 2 ? [] : [kOutcome, ...shown].map(z => ({z, ...Card(get('maps'), columns[z].label)}));
  const along = [...study.keys.keys()].slice(0, 12).map(i => ({x: kFirstKey + i, ...Card(get('along'), study.keys[i])}));
  const Draw = () => {
    Filter();
    ShowChosen();
    for (const {z, canvas, text} of maps)
      canvas.parentElement.hidden = DrawMap(canvas, kFirstKey, kFirstKey + 1, z, text) === false && z !== kOutcome;
    const [x, y, color, cx, cy, cz] = ['x', 'y', 'color', 'cx', 'cy', 'cz'].map(id => Number(byId(id)?.value));
    if (study.keys.length > 1) DrawMap(byId('map'), cx, cy, cz, byId('range'));
    DrawPair(byId('scatter'), x, y, color);
    for (const {x, canvas} of along) DrawPair(canvas, x, y, kOutcome, rows, /*withMedian=*/true);
    if (study.history.length) DrawHistory();
    DrawPair(byId('effort'), energy, error, kOutcome, rows.filter(row => Show(value(row, kOutcome), kOutcome) === 'tracked'));
    DrawImportance(y);
    DrawTable();
  };
  const Fill = (id, from, to, start, first = []) => {
    for (const i of [...first, ...[...columns.keys()].slice(from, to).filter(i => isUsed[i])]) byId(id).append(new Option(columns[i].label, i));
    Object.assign(byId(id), {value: start, onchange: Draw});
  };
  const GoToHash = () => {
    const number = Number((location.hash.match(/^#trial-(\d+)$/) ?? [])[1] ?? NaN);
    const row = [...Array(count).keys()].find(row => value(row, kNumber) === number);
    if (row !== undefined) Choose(row);
  };

  ShowSummary();
  const drop = (id, gone) => { if (gone) get(id).remove(); };
  drop('findings', !study.findings.length);
  drop('effects', !study.sensitivity.length);
  drop('best', !study.best || !study.best.order);
  drop('history', !study.history.length);
  drop('over-two', study.keys.length < 2);
  get('trials-text').textContent = 'A trial that is chosen, here or in a chart, shows the command that repeats it.' + (isPart
    ? ` Here are ${drawn} of ${study.done} trials, those of points that a hash of their number draws, with all their seeds` +
      `${added.size ? `, and ${added.size} of the best, which are marks in charts and count nowhere` : ''}. ` +
      `${study.done - count} trials are left out; "dexcheck study show DB NUMBER" shows any of them,` : '') + ' "dexcheck study export DB" writes all as CSV.';
  for (const [id, name] of [['effects', 'Which key matters'], ['outcomes', 'Outcomes'], ['explore', 'Look closer'], ['best', 'Best'],
    ['trials', 'Trials']]) {
    if (get(id)) Add(get('study-nav'), Make('a', name, {href: '#' + id}));
  }
  if (!count) {
    get('explore').remove();
    get('trials').remove();
    return;
  }
  Fill('x', kFirstKey, width, kFirstKey);
  Fill('y', firstMetric, width, shown[0]);
  Fill('color', kFirstKey, width, kOutcome, [kOutcome]);
  if (study.keys.length > 1) {
    Fill('cx', kFirstKey, firstMetric, kFirstKey);
    Fill('cy', kFirstKey, firstMetric, kFirstKey + 1);
    // Another quantity than the maps above.
    const other = [...columns.keys()].find(i => i >= firstMetric && isUsed[i] && !shown.includes(i)) ?? shown[0];
    Fill('cz', firstMetric, width, study.is_grid ? other : kOutcome, [kOutcome]);
    if (!study.is_grid) get('charts').prepend(get('over-two'));
  }
  byId('outcome').append(new Option('any outcome', ''));
  study.outcomes.forEach((outcome, i) => byId('outcome').append(new Option(outcome.name, i)));
  byId('outcome').onchange = byId('filter').oninput = Draw;
  addEventListener('hashchange', GoToHash);
  Draw();
  GoToHash();
  get('explore').dataset.ready = 'yes';
})();
