// The page of a judged recording: verdict, causes, what the motion does not separate, joints, notes. page.js draws the plots.
'use strict';
(() => {
  const data = ReadJson('judgement');
  const {AddVerdict, AddSection, AddWhole} = MakeSections();
  const several = data.recordings.length > 1;
  const Short = x => x === null || x === undefined ? '–' : String(Number(x.toPrecision(3)));
  const Percent = fraction => `${Number((100 * fraction).toPrecision(3))} %`;
  const Count = (n, word) => `${n} ${word}${n === 1 ? '' : 's'}`;

  Add(document.querySelector('h1'), Make('b', data.robot), ' – does it explain ', several ? Count(data.recordings.length, 'recording') : data.recordings[0], '?');
  const Ratio = joint => joint.left / joint.noise;
  const Span = values => [...new Set([Math.min(...values), Math.max(...values)].map(Short))].join(' to ');
  const causes = data.causes;
  const tone = {explained: 'pass', 'not explained': 'fail', differs: 'open', 'partly explained': 'open'}[data.verdict];
  const rest = data.verdict === 'differs' || data.verdict === 'not explained' ? ` ${Span(data.joints.map(Ratio))} times the noise is left.` : '';
  const word = data.verdict.toUpperCase(), sentence = data.verdict_text + rest;
  AddVerdict(tone, word, Make('p', sentence), ...(several ? [Make('p', data.recordings.join(', '))] : []));
  const worst = data.joints.reduce((a, b) => Ratio(b) > Ratio(a) ? b : a);
  Add(document.querySelector('header'), Add(Make('div', '', {className: 'tiles'}), ...[
    [data.rows.toLocaleString('en'), several ? `rows of ${data.recordings.length} recordings` : 'rows'],
    [String(new Set(data.joints.map(({joint}) => joint)).size), 'joints judged'],
    ...(causes.length ? [[Percent(data.explained), 'of the unexplained torque is explained by the causes']] : []),
    [Short(Ratio(worst)) + ' ×', `the noise is left, most at ${worst.joint}`],
  ].map(([value, label]) => Card('', Make('b', value), Make('span', label)))));

  // What one cause adds to the others.
  const Part = cause => Math.min(Math.max(cause.fraction - (1 - data.explained), 0), 1);
  const Meter = cause => Add(Make('div', Percent(Part(cause)), {className: 'number'}),
    Add(Make('span', '', {className: 'meter accent'}), Make('i', '', {style: `width: ${100 * Part(cause)}%`})));
  if (causes.length) {
    AddSection('Causes', Make('p', 'The cause that explains most comes first; ± is one standard error.' + (causes.some(cause => cause.faults.length > 1) ? ' This motion does not separate the faults of one row.' : ''), {className: 'soft'}),
      Card('scroll', CauseTable(causes.map(cause => {
        const begin = data.begins[Math.max(cause.recording, 0)];
        const place = several && cause.recording >= 0 ? `in ${data.recordings[cause.recording]}` : '';
        const faults = cause.faults.map(fault => fault.detail?.endsWith(place) ? fault : {...fault, detail: [fault.detail, place].filter(Boolean).join(' ')});
        return {...cause, faults, when: cause.from_s === null ? null : [cause.from_s - begin, cause.to_s - begin]};
      }), [['explains', Meter]])));
  }

  // Which explanations stand for which cause: columns are causes.
  const Name = fault => `${fault.place}: ${fault.fault}`;
  const rows = [...new Set(causes.flatMap(cause => [...cause.faults.map(Name), ...(cause.rival ? [cause.rival] : [])]))];
  if (rows.length > causes.length) {
    const matrix = Make('table', '', {className: 'matrix isolable'});
    Add(matrix, Add(Make('tr'), Make('th', 'explanation'), ...causes.map((_, i) => Make('th', String(i + 1), {className: 'cell'}))));
    for (const row of rows) {
      Add(matrix, Add(Make('tr'), Make('td', row), ...causes.map((cause, i) => {
        const at = cause.faults.findIndex(fault => Name(fault) === row), is_rival = at < 0 && cause.rival === row;
        const kind = at < 0 ? is_rival ? 'rival' : '' : cause.outcome === 'named' ? 'named' : 'same';
        const cell = Make('td', '', {className: 'cell ' + kind});
        if (!kind) return cell;
        const text = {named: 'the only one that explains it', same: 'explains it as well as the others of this column'}[kind] ??
          `${ShowOdds(cause.log_odds)} times less likely`;
        cell.title = `cause ${i + 1}: ${row}: ${text}`;
        return Add(cell, Make('i', is_rival ? '1e' + Math.round(Math.min(cause.log_odds / Math.LN10, 20)) : kind === 'named' ? '●' : at === 0 ? '◆' : '◇', {role: 'img', ariaLabel: text}));
      })));
    }
    const Mark = (kind, mark, words) => Add(Make('span', '', {className: 'cell ' + kind}), Make('i', mark), ' ' + words);
    AddSection('Alternatives', Add(Make('p', '', {className: 'soft legend'}), 'Columns are the causes above. ', Mark('named', '●', 'the only one that explains it'), Mark('same', '◆', 'one of a class'),
      Mark('same', '◇', 'explains it as well'), Mark('rival', '1e3', '1000 times less likely')), Card('scroll', matrix));
  }

  // Each joint's torques on one logarithmic line.
  const kinds = [['torque', 'measured'], ['residual', 'unexplained'], ['left', 'left'], ['noise', 'noise']];
  const sizes = data.joints.flatMap(joint => kinds.map(([key]) => joint[key])).filter(x => x > 0);
  const low = Math.log10(Math.min(...sizes)), span = Math.max(Math.log10(Math.max(...sizes)) - low, 1e-9);
  const Strip = joint => Add(Make('div', '', {className: 'strip', role: 'img', ariaLabel: kinds.map(([key, words]) => `${words} ${Short(joint[key])}`).join(', ')}),
    ...kinds.filter(([key]) => joint[key] > 0).map(([key, words]) => Make('i', '', {className: key, title: `${words} ${Short(joint[key])}`,
      style: `left: ${Math.round(1000 * (Math.log10(joint[key]) - low) / span) / 10}%`})));
  const has_gains = data.joints.some(joint => joint.drive_gain !== undefined);
  const Joints = joints => Card('scroll joints', Table(['joint', 'measured', 'unexplained', 'left', 'noise', 'held out', ...(has_gains ? ['N m/A'] : []), 'sizes'],
    joints.map(joint => [joint.joint, ...['torque', 'residual', 'left', 'noise', 'held_left', ...(has_gains ? ['drive_gain'] : [])].map(key => Short(key === 'held_left' ? joint[key] || null : joint[key])), Strip(joint)])));
  AddSection('Joints', Add(Make('p', 'Root mean squares of torques, N m or N: unexplained by the model, left after the causes, and left on the quarter that was held out from their search. ', {className: 'soft legend'}),
    ...kinds.map(([key, words]) => Add(Make('span', '', {className: 'strip-key'}), Make('i', '', {className: key}), words)), 'on a logarithmic line.'),
    ...data.recordings.flatMap((name, i) => [...(several ? [Make('h3', name, {className: 'group'})] : []), Joints(data.joints.filter(joint => joint.recording === i))]));
  const replay = document.getElementById('replay-html');
  if (replay && several) replay.content.querySelector('.card').after(Make('p', `The motion of ${data.recordings[0]}.`, {className: 'soft'}));
  if (replay) AddWhole('Replay', replay.content);
  AddWhole('Plots', Make('section', '', {id: 'plots'}));
  AddSection('Notes', Card('', Add(Make('ul'), ...data.notes.map(note => Make('li', note)),
    Make('li', 'Plots show means over short stretches of time, without pauses; the shaded band is twice the noise of one sample.'),
    ...data.begins.flatMap((begin, i) => begin ? [Make('li', `${data.recordings[i]}: times are from ${begin.toFixed(3)} s of its clock.`)] : []),
    Add(Make('li', 'Model: '), Make('code', data.model), '.'))));
  Add(document.querySelector('footer'), "Made by dexcheck judge. Plots by Chart.js (MIT license)" + (replay ? ', scene by three.js (MIT license).' : '.'));
})();
