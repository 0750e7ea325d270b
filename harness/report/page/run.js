// The page of a run: verdict, categories, replay, video, pictures, checks and inputs. page.js draws the plots.
'use strict';
(() => {
  const run = ReadJson('run-page');
  const header = document.querySelector('header');
  const {AddVerdict, AddSection, AddWhole} = MakeSections();
  const {summary} = run, checks = run.categories.flatMap(category => category.checks), has_checks = checks.length > 0;
  const IsReached = check => check.reached !== false, Fails = check => check.pass === false;
  /** What a check is judged by; JSON has no infinity, and null in its place. */
  const Worst = check => (Fails(check) ? check.max : check.residual ?? check.max) ?? Infinity;
  const Fraction = check => {
    const bound = check.bound + (Fails(check) ? 0 : check.allowance ?? 0), worst = Worst(check);
    return bound > 0 ? worst / bound : worst > 0 ? Infinity : 0;
  };
  const WithUnit = (value, unit) => ShowNumber(value) + (unit === '1' || value === 0 ? '' : ' ' + unit);
  const Digits = (x, digits) => Number(x.toPrecision(digits));

  /** A button that brings the page to a time. */
  const TimeButton = (words, time, className = '') => {
    const button = Make('button', `${words} ${time.toFixed(3)} s`, {type: 'button', className});
    button.dataset.time = time;
    return button;
  };

  Add(document.querySelector('h1'), Make('b', run.scenario), summary.description ? ' – ' + summary.description : '');
  const {verdict} = run, {checks: causes_of_checks} = summary.attribution ?? {};
  const box = AddVerdict(verdict.tone, verdict.word, Make('p', verdict.sentence));
  if (verdict.causes.length) Add(box, Add(Make('ol'), ...verdict.causes.map(cause => Make('li', cause))));
  Add(box, ...verdict.remarks.map(remark => Make('p', remark[0].toUpperCase() + remark.slice(1) + '.')));
  const first = checks.filter(check => Fails(check) && 'failed_at_s' in check).sort((a, b) => a.failed_at_s - b.failed_at_s)[0];
  if (first) Add(box, Add(Make('p'), TimeButton(`See it: ${first.name} fails from`, first.failed_at_s)));
  if (summary.interrupted) Add(box, Make('p', `The run was stopped by hand after ${run.end.toFixed(3)} s.`));
  const Tiles = tiles => Add(header, Add(Make('div', '', {className: 'tiles'}), ...tiles));
  if (has_checks) {
    for (const category of run.categories) {
      const reached = category.checks.filter(check => IsReached(check) && !check.empty), late = category.checks.filter(check => !IsReached(check)).length;
      category.extent = [...(reached.length ? [`${reached.length} check${reached.length === 1 ? '' : 's'}, at most ${
        ShowFraction(Math.max(...reached.map(Fraction)))} of a bound`] : []), ...(late ? [late + ' not reached'] : [])].join('; ');
    }
    Tiles(run.categories.map(category => {
      const tile = Make('a', '', {className: 'card category ' + category.tone});
      if (category.checks.length) tile.href = '#checks-' + category.name;
      return Add(tile, Make('b', `${category.title}: ${category.word}`), Make('span', category.explanation), Make('span', category.extent));
    }));
  }
  const {tracking = {}, simulated_s = run.end, torque_limited = [], clearance = {}, speed = {}} = summary;
  const Error = (value, unit, label) => [!Number.isFinite(value) ? '–' : value > 0 && value < 1e-9 ? `< 1 n${unit}` : `${ShowNumber(value)} ${unit}`, label];
  const cone = checks.find(check => check.name === 'cone_use' && IsReached(check));
  Tiles([
    ...(Number.isFinite(tracking.joint_error_max_rad) ? [Error(tracking.joint_error_max_rad, 'rad', 'largest error of a joint')]
      : [Error(tracking.position_error_max_m, 'm', 'largest position error of the object'), Error(tracking.orientation_error_max_rad, 'rad', 'largest orientation error')]),
    [`${Digits(simulated_s, 4)} s`, `simulated, ${run.steps} steps`],
    ...(cone ? [[ShowFraction(cone.max ?? Infinity), "of the fingertips' friction used, at most"]] : []),
    ...torque_limited.map(one => [`${Digits(one.time_s, 3)} s`, 'torque limited: ' + one.motor]),
    // By class of bodies that should not touch.
    ...Object.entries(clearance).map(([pairs, nearest]) => [`${(1e3 * nearest.smallest_m).toFixed(1)} mm`, `${pairs.replaceAll('_', ' ')}: nearest are ${nearest.bodies}`]),
    ...(Number.isFinite(speed.real_time_factor) ? [[`${Digits(speed.real_time_factor, 2)} ×`, 'real time']] : []),
  ].map(([value, label]) => Card('', Make('b', value), Make('span', label))));

  // What explains the residuals. This motion does not separate the faults of one row.
  if (summary.causes?.length) {
    AddSection('Causes', Card('scroll', CauseTable(summary.causes.map(cause => ({...cause, when: [cause.from_s, cause.ends ? cause.to_s : null]})), [['where seen', cause => cause.channel],
      ['explained', cause => `${Number((100 * cause.fraction).toPrecision(3))} %`]])));
  }

  const replay = document.getElementById('replay-html');
  if (replay) AddWhole('Replay', replay.content);
  if (run.video) {
    AddSection('Video', run.video.is_embedded
      ? Make('video', '', {controls: true, playsInline: true, preload: 'metadata', src: 'data:video/mp4;base64,' + ReadText('run-video')})
      : Add(Make('p'), Make('a', run.video.name, {href: run.video.link}), ' (too large to be part of this page)'));
  }
  if (run.pictures.length) {
    AddSection('Pictures', Add(Make('div', '', {className: 'grid'}), ...run.pictures.map(({panel, title, data}) =>
      Add(Make('figure', '', {className: 'card'}),
        Add(Make('figcaption'), ...(panel ? [Make('b', 'Figure ' + panel)] : []), title),
        Make('img', '', {alt: title, src: 'data:image/png;base64,' + ReadText(data)})))));
  }
  AddWhole('Plots', Make('section', '', {id: 'plots'}));

  const CheckRow = check => {
    const Cell = (className, label, ...children) => {
      const cell = Make('td', '', {className});
      if (label) cell.dataset.label = label;
      return Add(cell, ...children);
    };
    const fails = Fails(check), is_timed = 'at_time_s' in check, of_bound = Fraction(check), why = fails && causes_of_checks?.[check.name];
    const where = [check.where, ...(is_timed ? [check.at_time_s.toFixed(3) + ' s'] : [])].filter(Boolean).join(', ');
    return Add(Make('tr', '', {className: fails ? 'fail' : 'pass'}),
      Cell('', '', Make('code', check.name), Make('small', check.description ?? '')),
      Cell('', '', fails && is_timed ? TimeButton('fails from', check.failed_at_s, 'badge')
        : Make('span', fails ? 'differs' : ['', 'ok'].includes(check.status) ? 'holds' : check.status, {className: 'badge'}), ...(why ? [Make('small', 'cause: ' + why)] : [])),
      Cell('value number', 'worst', IsReached(check) ? WithUnit(Worst(check), check.unit) : '–'),
      Cell('value number', 'bound', WithUnit(check.bound, check.unit), ...(check.allowance && !fails ? [Make('small', '+ allowance ' + WithUnit(check.allowance, check.unit))] : [])),
      Cell('', 'of bound', Make('span', IsReached(check) ? ShowFraction(of_bound) : '', {className: 'number'}),
        Add(Make('span', '', {className: 'meter'}), Make('i', '', {style: `width:${IsReached(check) ? 100 * Math.min(of_bound, 1) : 0}%`}))),
      Cell('where', where ? 'at' : '', Make('small', where)));
  };
  const CheckTable = checks => Add(Make('table', '', {className: 'checks'}),
    Add(Make('thead'), Add(Make('tr'), Make('th', 'check'), Make('th', 'verdict'), Make('th', 'worst', {className: 'value'}),
      Make('th', 'bound', {className: 'value'}), Make('th', 'of bound'), Make('th', 'where, when'))),
    Add(Make('tbody'), ...checks.map(CheckRow)));
  /** The checks of a category, folded unless one fails; constants that agree by themselves. */
  const Category = category => {
    const IsEqual = check => !Fails(check) && IsReached(check) && !('at_time_s' in check);
    const shown = category.checks.filter(check => !IsEqual(check)), equal = category.checks.filter(IsEqual);
    const fold = Add(Make('details', '', {className: 'check-group ' + category.tone, id: 'checks-' + category.name, open: category.tone === 'fail'}),
      Add(Make('summary'), Make('b', category.title), ' ', Make('span', category.word, {className: 'badge'}),
        ` ${category.explanation}: ${category.extent}`));
    if (shown.length) Add(fold, CheckTable(shown));
    if (equal.length)
      Add(fold, Add(Make('details'), Make('summary', `${equal.length} constants of both descriptions agree`), CheckTable(equal)));
    return fold;
  };
  if (has_checks) {
    AddSection('Checks', Make('p', 'What failed first, then by fraction of the bound. A bound is what rounding, or the tolerance of the ' +
      'assumption, can explain.', {className: 'soft'}),
    Card('', ...run.categories.filter(category => category.checks.length).map(Category)));
  }

  if (summary.gain_card) AddSection('Gains', GainCard(summary.gain_card));

  const {texts} = run, overrides = texts.overrides.trimEnd();
  const inputs = [['Command', texts.command, true], ['Overrides', overrides || 'none', overrides], ['Seed', texts.seed], ['Model', texts.robot],
    ['MJCF', texts.mjcf], ['dexcheck', texts.dexcheck_version], ['MuJoCo', texts.mujoco_version], ['Machine', texts.machine]];
  AddSection('Inputs', Card('', Add(Make('dl'), ...inputs.filter(([, text]) => text).flatMap(([term, text, is_code]) =>
    [Make('dt', term), Add(Make('dd'), is_code ? Make('code', text) : text)])),
  ...run.files.map(({title, text, open}) =>
    Add(Make('details', '', {open}), Make('summary', title), Make('pre', text, {tabIndex: 0})))));
  Add(document.querySelector('footer'), `Made by dexcheck ${run.texts.dexcheck_version} from the run's log, which holds every number, and the inputs to ` +
    'repeat the run bit for bit: ', Make('code', 'dexcheck run --replay RUN_DIR'), '. Plots by Chart.js, replay by three.js (copyright ' +
    '2010-2019 three.js authors; both MIT license).');
})();
