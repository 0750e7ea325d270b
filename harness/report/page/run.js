// The page of a run: verdict, categories, replay, video, pictures, checks and inputs. page.js draws the plots.
'use strict';
(() => {
  const run = ReadJson('run-page');
  const header = document.querySelector('header');
  const {AddVerdict, AddSection, AddWhole} = MakeSections();
  const has_checks = run.categories.some(category => category.checks.length);

  /** A button that brings the page to a time. */
  const TimeButton = (words, time, className = '') => {
    const button = Make('button', `${words} ${time.toFixed(3)} s`, {type: 'button', className});
    button.dataset.time = time;
    return button;
  };

  Add(document.querySelector('h1'), Make('b', run.scenario), run.description ? ' – ' + run.description : '');
  const {verdict} = run;
  const box = AddVerdict(verdict.tone, verdict.word, Make('p', verdict.sentence));
  if (verdict.cause) Add(box, Add(Make('p', 'Cause: '), Make('b', verdict.cause), `. Evidence: ${verdict.evidence}.`));
  if (verdict.first_failure)
    Add(box, Add(Make('p'), TimeButton(`See it: ${verdict.first_failure.check} fails from`, verdict.first_failure.time)));
  if (verdict.stopped_at !== null) Add(box, Make('p', `The run was stopped by hand after ${verdict.stopped_at.toFixed(3)} s.`));
  const Tiles = tiles => Add(header, Add(Make('div', '', {className: 'tiles'}), ...tiles));
  if (has_checks) {
    Tiles(run.categories.map(category => {
      const tile = Make('a', '', {className: 'card category ' + category.tone});
      if (category.checks.length) tile.href = '#checks-' + category.name;
      return Add(tile, Make('b', `${category.title}: ${category.word}`), Make('span', category.explanation), Make('span', category.extent));
    }));
  }
  Tiles(run.tiles.map(([value, label]) => Card('', Make('b', value), Make('span', label))));

  // What explains the residuals. Faults of one row are not told apart by this motion.
  if (run.causes.length) {
    AddSection('Causes', Card('scroll', CauseTable(run.causes.map(cause => ({...cause, when: [cause.from_s, cause.ends ? cause.to_s : null]})), [['where seen', cause => cause.channel],
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
    return Add(Make('tr', '', {className: check.failed ? 'fail' : 'pass'}),
      Cell('', '', Make('code', check.name), Make('small', check.description)),
      Cell('', '', check.fails_from === null ? Make('span', check.failed ? 'differs' : ['', 'ok'].includes(check.status) ? 'holds' : check.status, {className: 'badge'})
        : TimeButton('fails from', check.fails_from, 'badge'), ...(check.cause ? [Make('small', 'cause: ' + check.cause)] : [])),
      Cell('value number', 'worst', check.worst), Cell('value number', 'bound', check.bound, ...(check.allowance ? [Make('small', '+ allowance ' + check.allowance)] : [])),
      Cell('', 'of bound', Make('span', check.of_bound, {className: 'number'}),
        Add(Make('span', '', {className: 'meter'}), Make('i', '', {style: `width:${check.meter}%`}))),
      Cell('where', check.where ? 'at' : '', Make('small', check.where)));
  };
  const CheckTable = checks => Add(Make('table', '', {className: 'checks'}),
    Add(Make('thead'), Add(Make('tr'), Make('th', 'check'), Make('th', 'verdict'), Make('th', 'worst', {className: 'value'}),
      Make('th', 'bound', {className: 'value'}), Make('th', 'of bound'), Make('th', 'where, when'))),
    Add(Make('tbody'), ...checks.map(CheckRow)));
  /** The checks of a category, folded unless one fails; constants that agree by themselves. */
  const Category = category => {
    const shown = category.checks.filter(check => !check.is_equal), equal = category.checks.filter(check => check.is_equal);
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

  if (run.gain_card) AddSection('Gains', GainCard(run.gain_card));

  AddSection('Inputs', Card('', Add(Make('dl'), ...run.inputs.filter(([, text]) => text).flatMap(([term, text, is_code]) =>
    [Make('dt', term), Add(Make('dd'), is_code ? Make('code', text) : text)])),
  ...run.files.map(({title, text, open}) =>
    Add(Make('details', '', {open}), Make('summary', title), Make('pre', text, {tabIndex: 0})))));
  Add(document.querySelector('footer'), `Made by dexcheck ${run.version} from the run's log, which holds every number, and the inputs to ` +
    'repeat the run bit for bit: ', Make('code', 'dexcheck run --replay RUN_DIR'), '. Plots by Chart.js, replay by three.js (copyright ' +
    '2010-2019 three.js authors; both MIT license).');
})();
