// Elements of a page, made of its data. Texts are set as texts: nothing in them is markup.
'use strict';
const Make = (tag, text = '', attributes = {}) => Object.assign(document.createElement(tag), {textContent: text}, attributes);
const Add = (parent, ...children) => { parent.append(...children); return parent; };
const Card = (className, ...children) => Add(Make('div', '', {className: 'card ' + className}), ...children);
/** Cells are texts or elements; columns from `left` on have numbers. A row that passes or fails is {className, cells}. */
const Table = (heads, rows, left = 1) => {
  const Row = (tag, cells, className = '') => Add(Make('tr', '', {className}), ...cells.map((cell, i) =>
    Add(Make(tag, '', {className: i < left ? '' : tag === 'th' ? 'value' : 'value number'}), cell)));
  return Add(Make('table'), Row('th', heads), ...rows.map(row => Row('td', row.cells ?? row, row.className)));
};
const ReadText = id => document.getElementById(id).textContent;
const ReadJson = id => JSON.parse(ReadText(id));
const ReadBytes = id => Uint8Array.from(atob(ReadText(id)), c => c.charCodeAt(0)).buffer;

/** "2.6e-15", "0", "infinite": a number in three digits or two. */
const ShowNumber = x => !Number.isFinite(x) ? 'infinite' : x === 0 ? '0' :
  Math.abs(x) >= 0.01 && Math.abs(x) < 1e4 ? String(Number(x.toPrecision(3))) : x.toExponential(1);

/** "4.5 %", "25 ×": a check's value as a fraction of its bound. 99.7 % is not yet the whole bound, and 150 % is no power of ten. */
const ShowFraction = fraction => {
  if (!Number.isFinite(fraction)) return 'beyond any bound';
  if (fraction === 0 || fraction > 10) return ShowNumber(fraction) + (fraction > 10 ? ' ×' : '');
  const percent = 100 * fraction;
  if (percent < 0.01) return '< 0.01 %';
  return (percent >= 99.5 ? percent.toFixed(percent < 100 ? 1 : 0) : Number(percent.toPrecision(2))) + ' %';
};

/** A value with the digits that its standard error leaves: null is any size. */
const TellValue = (value, error, unit = '') => {
  const tail = unit ? ' ' + unit : '';
  if (error === null || value === null) return 'of any size';
  const digits = error > 0 ? Math.floor(Math.log10(Math.abs(value) || error)) - Math.floor(Math.log10(error)) + 2 : 6;
  const Short = (x, digits) => String(Number(x.toPrecision(Math.min(Math.max(digits, 1), 6))));
  return Short(value, digits) + (error > 0 ? ` ± ${Short(error, 2)}` : '') + tail;
};
const ShowOdds = odds => odds > 46 ? 'more than 1e20' : Number(Math.exp(odds).toPrecision(1)).toLocaleString('en', {maximumFractionDigits: 0, notation: odds > 12 ? 'scientific' : 'standard'}).replace('E', 'e');
/** Causes with their faults, which one motion does not separate, rivals and times: {outcome, faults, rival, log_odds, when, parts}.
    @param columns [[head, cause => cell]] besides. */
const CauseTable = (causes, columns = []) => {
  const Fault = (fault, parts) => Add(Make('div'), Make('b', `${fault.place}: ${fault.fault}`),
    ...(parts || fault.value === null || (fault.value === 0 && !fault.standard_error) ? [] : [' ', Make('span', TellValue(fault.value, fault.standard_error, fault.unit), {className: 'number'})]),
    parts ? '' : fault.detail ? ' ' + fault.detail : '');
  const Parts = parts => {
    const joints = [...new Set(parts.map(part => part.place))], kinds = [...new Set(parts.map(part => part.fault))];
    const unit = kind => parts.find(part => part.fault === kind).unit;
    // From 0, with a whisker of the standard error on either side.
    const Interval = part => {
      const all = parts.filter(({fault}) => fault === part.fault).map(({value, standard_error: e}) => [value - e, value + e, 0]).flat().filter(Number.isFinite);
      const low = Math.min(...all), span = Math.max(...all) - low || 1, At = x => `${(100 * (x - low) / span).toFixed(1)}%`;
      const Bar = (tag, from, to) => Make(tag, '', {style: `left: ${At(from)}; width: ${(100 * (to - from) / span).toFixed(1)}%`});
      return Add(Make('span', '', {className: 'interval'}), Bar('i', Math.min(part.value, 0), Math.max(part.value, 0)),
        ...(part.standard_error === null ? [] : [Bar('b', part.value - part.standard_error, part.value + part.standard_error)]));
    };
    const Cell = part => part ? Add(Make('div'), TellValue(part.value, part.standard_error), Interval(part)) : '';
    return Add(Make('div', '', {className: 'parts'}), Table(['joint', ...kinds.map(kind => `${kind}, ${unit(kind)}`)], joints.map(joint => [joint,
      ...kinds.map(kind => Cell(parts.find(part => part.place === joint && part.fault === kind)))])));
  };
  /** A button that brings the page there. */
  const When = ([from, to]) => {
    const button = Make('button', `${from.toFixed(3)} to ${to === null ? 'the end' : to.toFixed(3)}`, {type: 'button', title: 'Show it'});
    button.dataset.time = from;
    return button;
  };
  const has_time = causes.some(({when}) => when);
  return Table(['#', 'fault', ...columns.map(([head]) => head), 'nearest other', ...(has_time ? ['when, s'] : [])], causes.map((cause, i) => ({
    className: cause.outcome === 'named' ? '' : 'open', cells: [String(i + 1),
      Add(Make('div', '', {className: 'faults'}), ...(cause.outcome === 'named' ? [] : [Make('small', cause.outcome === 'not explained' ? 'not explained; nearest:' :
        cause.faults.length > 1 ? 'one of these, which this motion does not separate:' : 'of a size that this motion does not show:')]),
        ...cause.faults.map((fault, k) => Fault(fault, k === 0 && cause.parts)), ...(cause.parts ? [Parts(cause.parts)] : [])),
      ...columns.map(([, Cell]) => Cell(cause)),
      Make('small', cause.rival ? `${cause.rival}, ${ShowOdds(cause.log_odds)} times less likely` : ''),
      ...(has_time ? [cause.when ? When(cause.when) : 'always'] : [])]})), 99);
};

/** Gains as TOML, to be copied. */
const GainCard = text => {
  const copy = Make('button', 'Copy', {type: 'button'});
  copy.addEventListener('click', () => navigator.clipboard.writeText(text));
  return Add(Make('div', '', {className: 'card gains'}), copy, Make('pre', text, {tabIndex: 0}));
};

/** Of pages with plots: verdict and sections, which the navigation leads to. */
const MakeSections = () => {
  const main = document.querySelector('main'), links = document.querySelector('nav > div');
  const Link = title => Add(links, Make('a', title, {href: '#' + title.toLowerCase()}));
  return {
    AddVerdict: (tone, word, ...children) => {
      Link('Verdict');
      const verdict = document.getElementById('verdict');
      verdict.classList.add(tone);
      return Add(verdict, Make('strong', word), ...children);
    },
    AddSection: (title, ...children) => {
      Link(title);
      Add(main, Make('h2', title, {id: title.toLowerCase()}), ...children);
    },
    /** What brings its own heading. */
    AddWhole: (title, element) => {
      Link(title);
      Add(main, element);
    },
  };
};
