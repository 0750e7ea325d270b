// The page of an error budget.
'use strict';
(() => {
  const budget = JSON.parse(document.getElementById('budget-data').textContent);
  const {style, Short, Bars} = MakeCharts();
  const get = id => document.getElementById(id), unit = budget.unit ?? 'm';
  const rms = size => size[budget.unit ? 'rms' : 'rms_m'], max = size => size[budget.unit ? 'max' : 'max_m'];
  get('budget-name').textContent = budget.scenario;
  get('budget-of').textContent = budget.unit ? 'the largest error of a joint' : "the object's position error";
  get('budget-failure').textContent = budget.failure;
  const all = [...budget.sources, {name: 'sum of the above', alone: budget.sum, predicted: budget.predicted},
    {name: 'all together', alone: budget.all, predicted: budget.predicted}];
  const values = all.flatMap(s => [rms(s.alone), rms(s.predicted)]).filter(x => x > 0);
  const least = 10 ** Math.floor(Math.log10(Math.min(...values))), most = 10 ** Math.ceil(Math.log10(Math.max(...values)));
  Bars(get('budget-chart'), {labels: all.map(s => s.name), unit, log: true, least, most, sets: [
    {label: 'measured', values: all.map(s => rms(s.alone)), color: all.map(s => s.interacts ? '#c2571a' : style('--accent'))},
    {label: 'predicted', values: all.map(s => rms(s.predicted)), color: style('--soft')}].filter(set => set.values.some(x => x > 0))});
  const Add = cells => {
    const tr = get('budget-table').insertRow();
    cells.forEach((cell, i) => Object.assign(tr.insertCell(), {textContent: typeof cell === 'number' ? Short(cell) : cell ?? '', className: i ? 'value' : ''}));
  };
  for (const s of budget.sources) {
    Add([s.name, rms(s.alone), max(s.alone), rms(s.predicted), rms(s.without), (100 * s.interaction).toFixed(0) + ' %', s.failure || (s.interacts ? 'interacts' : '')]);
  }
  for (const [name, size] of [['none of them', budget.ideal], ['sum of the above', budget.sum], ['all together', budget.all]]) Add([name, rms(size), max(size)]);
})();
