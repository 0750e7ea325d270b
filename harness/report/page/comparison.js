// The page of a comparison of runs: verdict, inputs, results, checks, signals. page.js draws the plots.
'use strict';
(() => {
  const data = ReadJson('comparison');
  const {AddVerdict, AddSection, AddWhole} = MakeSections();
  const letters = data.names.map((_, i) => String.fromCharCode(65 + i));
  const Code = text => Make('code', text);

  Add(document.querySelector('h1'), Make('b', 'Comparison'), ` of ${letters.length} runs`);
  const box = AddVerdict(data.same ? 'pass' : 'open', data.same ? 'SAME' : 'DIFFERENT', ...letters.map((letter, i) =>
    Add(Make('p'), Make('b', letter), ' ', Code(data.names[i]), ': ' + data.verdicts[i])));
  if (data.first) {
    Add(box, Add(Make('p', 'The first signal that differs is '), Code(data.first.name), `, at ${data.first.time.toFixed(3)} s.`));
  }
  AddSection('Inputs', Card('scroll', data.inputs.length
    ? Table(['input', ...letters], data.inputs.map(({name, values}) => [Code(name), ...values.map(value => value || 'none')]), 99)
    : Make('p', 'None: scenario, overrides, parameters, MJCF, versions and machine are the same.')));

  const Numbers = numbers => Table(['', ...letters, ...letters.slice(1).map(letter => letter + ' / A')],
    numbers.map(({name, values, fails, ratios}) => ({
      className: fails.includes(true) ? 'fail' : 'pass',
      cells: [name, ...values.map((value, i) => fails[i] ? Make('span', value, {className: 'badge'}) : value), ...ratios],
    })));
  if (data.results.length) AddSection('Results', Card('scroll', Numbers(data.results)));
  // Those that fail first; constants that agree exactly in all runs are folded.
  const zeros = data.checks.filter(check => check.is_zero), others = data.checks.filter(check => !check.is_zero);
  const fails = others.filter(check => check.fails.includes(true));
  const shown = [...fails, ...others.filter(check => !fails.includes(check))];
  if (data.checks.length) {
    AddSection('Checks', Card('scroll', ...(shown.length ? [Numbers(shown)] : []), ...(zeros.length ? [Add(Make('details'),
      Make('summary', `${zeros.length} check${zeros.length === 1 ? ' is' : 's are'} 0 in all runs`), Numbers(zeros))] : [])));
  }
  AddSection('Signals', Card('scroll', Table(['signal', '', 'largest difference', 'of its size', 'at'], data.signals.map(signal => ({
    className: signal.differs ? 'open' : 'pass',
    cells: [Code(signal.name), `${letters[signal.run]} - A`, signal.difference, signal.fraction, signal.at.toFixed(3) + ' s'],
  })), 2), ...(data.not_compared.length ? [Add(Make('p', 'Not in all runs, or with other columns:', {className: 'soft'}),
    ...data.not_compared.flatMap(name => [' ', Code(name)]))] : [])));
  AddWhole('Plots', Make('section', '', {id: 'plots'}));
  Add(document.querySelector('footer'), "Made by dexcheck from the runs' logs. Plots by Chart.js (MIT license).");
})();
