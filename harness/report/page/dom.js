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
