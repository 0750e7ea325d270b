// The page of a campaign of faults: what was made, what was found, and how it was named.
'use strict';
(() => {
  const campaign = ReadJson('campaign-data');
  const {AddVerdict, AddSection} = MakeSections();
  Add(document.querySelector('h1'), Make('b', campaign.scenario ?? campaign.robot), ' – faults made on purpose');
  const found = campaign.faults.filter(fault => fault.outcome === 'found');
  const survived = campaign.faults.filter(fault => fault.outcome === 'survived');
  AddVerdict(survived.length ? 'open' : 'pass', survived.length ? 'SURVIVORS' : 'ALL FOUND',
    Make('p', `${found.length} of ${found.length + survived.length} faults that are possible and have an effect were found.`));

  // Each fault that has a size, and the name that it got.
  const Kind = name => name.replace(/^signal of .*/, 'signal of another one').replace(/ \(.*\), factor$/, ', factor');
  const names = found.flatMap(fault => fault.names ?? []).map(one => ({injected: Kind(one.injected), named: Kind(one.named)}));
  const injected = [...new Set(names.map(one => one.injected))].sort();
  const last = ['a class', 'another value', 'nothing'];
  const named = [...injected, ...new Set(names.map(one => one.named).filter(one => !injected.includes(one) && !last.includes(one))), ...last];
  const Count = (row, column) => names.filter(one => one.injected === row && one.named === column).length;
  const used = named.filter(column => injected.some(row => Count(row, column)));
  if (names.length) {
    const right = names.filter(one => one.injected === one.named).length;
    const matrix = Make('table', '', {className: 'matrix'});
    Add(matrix, Add(Make('tr'), Make('th', 'injected'), ...used.map(column => Add(Make('th', '', {className: 'turned'}), Make('span', column))), Make('th', 'all', {className: 'value'})));
    for (const row of injected) {
      const all = names.filter(one => one.injected === row).length;
      Add(matrix, Add(Make('tr'), Make('td', row), ...used.map(column => {
        const count = Count(row, column), cell = Make('td', count || '', {className: 'value number'});
        const tone = column === row ? 'good' : last.includes(column) && column !== 'another value' ? 'warn' : 'bad';
        if (count) cell.style.background = `color-mix(in srgb, var(--${tone}) ${Math.round(15 + 60 * count / all)}%, transparent)`;
        cell.title = `${row}: ${count} of ${all} named ${column}`;
        return cell;
      }), Make('td', all, {className: 'value number'})));
    }
    AddSection('Names', Make('p', `${right} of ${names.length} faults that have a size are named with kind, place and value. A class is one of several that this motion does not separate.`, {className: 'soft'}),
      Add(Make('div', '', {className: 'card scroll'}), matrix));
  }
  AddSection('Kinds', Add(Make('div', '', {className: 'card scroll'}), Table(['kind', 'made', 'found', 'survived', 'without effect', 'cause right'],
    [...new Set(campaign.faults.map(fault => fault.kind))].map(kind => {
      const own = campaign.faults.filter(fault => fault.kind === kind);
      const Of = outcome => own.filter(fault => fault.outcome === outcome).length;
      return [kind, own.length, Of('found'), Of('survived') || '', Of('no effect') || '', own.filter(fault => fault.cause_right).length].map(String);
    }))));
  AddSection('Faults', Add(Make('div', '', {className: 'card scroll'}), Table(['fault', 'outcome', 'causes'],
    campaign.faults.map(fault => ({className: fault.outcome === 'found' ? '' : 'open', cells: [fault.name, fault.outcome, fault.causes || fault.evidence || fault.failure || '']})), 3)));
})();
