// The page of a comparison of runs: verdict, inputs, results, checks, signals. page.js draws the plots.
'use strict';
(() => {
  const data = ReadJson('comparison');
  const {AddVerdict, AddSection, AddWhole} = MakeSections();
  const letters = data.runs.map((_, i) => String.fromCharCode(65 + i));
  const Code = text => Make('code', text);

  Add(document.querySelector('h1'), Make('b', 'Comparison'), ` of ${letters.length} runs`);
  const box = AddVerdict(data.same ? 'pass' : 'open', data.same ? 'SAME' : 'DIFFERENT', ...letters.map((letter, i) =>
    Add(Make('p'), Make('b', letter), ' ', Code(data.runs[i]), ': ' + data.verdicts[i])));
  if (data.first) {
    Add(box, Add(Make('p', 'The first signal that differs is '), Code(data.first.name), `, at ${data.first.time_s.toFixed(3)} s.`));
  }
  const inputs = Object.entries(data.inputs);
  AddSection('Inputs', Card('scroll', inputs.length
    ? Table(['input', ...letters], inputs.map(([name, values]) => [Code(name), ...values.map(value => value || 'none')]), 99)
    : Make('p', 'None: scenario, overrides, parameters, MJCF, versions and machine are the same.')));

  // JSON has no infinity: of what is above its bound null is one, and otherwise nothing.
  const Show = (value, unit = '', fails = false) => value === null ? (fails ? 'infinite' : '–') : ShowNumber(value) + (unit && unit !== '1' ? ' ' + unit : '');
  const Ratio = (value, first) => value === null || first === null || (value === 0 && first === 0) ? '–' : ShowNumber(value / first);
  const List = numbers => Object.entries(numbers).map(([name, number]) => ({name, ...number}));
  const Numbers = numbers => Table(['', ...letters, ...letters.slice(1).map(letter => letter + ' / A')],
    numbers.map(({name, unit, values, fails}) => ({
      className: fails.includes(true) ? 'fail' : 'pass',
      cells: [name, ...values.map((value, i) => fails[i] ? Make('span', Show(value, unit, true), {className: 'badge'}) : Show(value, unit)),
        ...values.slice(1).map(value => Ratio(value, values[0]))],
    })));
  const results = List(data.results), checks = List(data.checks);
  if (results.length) AddSection('Results', Card('scroll', Numbers(results)));
  // Those that fail first; constants that agree exactly in all runs are folded.
  const zeros = checks.filter(check => check.values.every(value => value === 0) && !check.fails.includes(true));
  const others = checks.filter(check => !zeros.includes(check));
  const fails = others.filter(check => check.fails.includes(true));
  const shown = [...fails, ...others.filter(check => !fails.includes(check))];
  if (checks.length) {
    AddSection('Checks', Card('scroll', ...(shown.length ? [Numbers(shown)] : []), ...(zeros.length ? [Add(Make('details'),
      Make('summary', `${zeros.length} check${zeros.length === 1 ? ' is' : 's are'} 0 in all runs`), Numbers(zeros))] : [])));
  }
  AddSection('Signals', Card('scroll', Table(['signal', '', 'largest difference', 'of its size', 'at'], data.signals.map(signal => ({
    className: signal.differs ? 'open' : 'pass',
    cells: [Code(signal.column ? `${signal.name}.${signal.column}` : signal.name), `${letters[data.runs.lastIndexOf(signal.run)]} - A`,
      Show(signal.difference, signal.unit, true), ShowNumber(signal.difference === null ? NaN : signal.difference && signal.difference / signal.size),
      signal.at_time_s.toFixed(3) + ' s'],
  })), 2), ...(data.not_compared.length ? [Add(Make('p', 'Not in all runs, or with other columns:', {className: 'soft'}),
    ...data.not_compared.flatMap(name => [' ', Code(name)]))] : [])));
  AddWhole('Plots', Make('section', '', {id: 'plots'}));
  Add(document.querySelector('footer'), "Made by dexcheck from the runs' logs. Plots by Chart.js (MIT license).");
})();
