// The source beside the view: shows what the page tells on /source, and sends what a person does.
// All texts of others are put on the page as texts.

const [view, divider, panel, tabs, show, save, notes, text, diff, said] =
  ['view', 'divider', 'source', 'tabs', 'show', 'save', 'notes', 'text', 'diff', 'said']
    .map(id => document.getElementById(id));

const WISH_PERIOD = 50; // ms between two wishes of a hand
const STEP_WIDTH = 4; // pixels of a drag for one step of the last digit
const RECONNECTION = 1000; // ms until the page is asked for again
const UNREACHABLE = '`rosslt web` does not answer';

const state = {files: [], document: null, selected: []};
const fields = new Map(); // by the names of their numbers
let socket;
let opened = ''; // a file
let turn = 0; // what is changed within a turn is undone as one
let isBehind = false; // whether another document is shown once a drag over a number has ended
let follows = false; // whether to scroll to what is selected once its file is there

// Send a message; whether the page can be reached.
function send(message) {
  const isOpen = socket.readyState === WebSocket.OPEN;
  if (isOpen) {
    socket.send(JSON.stringify(message));
  }
  return isOpen;
}

function make(kind, properties, ...children) {
  const made = Object.assign(document.createElement(kind), properties);
  made.append(...children);
  return made;
}

// The text of a number that is a number of steps of its last digit away; null if the text is no decimal number.
function stepped(shown, steps) {
  const match = /^([-+]?)(\d*)\.?(\d*)([eE][-+]?\d+)?$/.exec(shown.replace(/[_ ]/g, ''));
  if (!match || !(match[2] + match[3])) {
    return null;
  }
  const [, sign, whole, fraction, exponent = ''] = match;
  const digits = BigInt(whole + fraction) * (sign === '-' ? -1n : 1n) + BigInt(steps);
  const written = String(digits < 0n ? -digits : digits).padStart(fraction.length + 1, '0');
  const point = written.length - fraction.length;
  const decimals = shown.includes('.') ? '.' + written.slice(point) : '';
  return (digits < 0n ? '-' : '') + written.slice(0, point) + decimals + exponent;
}

// What a field of a type is: 'bool', 'str' or 'number'.
const kindOf = type => type === 'int' || type === 'float' ? 'number' : type;

// A number, a text or a truth value in the text.
class Field {
  constructor(number) {
    this.kind = kindOf(number.type);
    this.isTyped = false; // something was typed that is not taken yet
    this.isTaken = false; // Enter was pressed: what is typed next takes its place
    this.drag = null; // {x, text, hasMoved} of a drag over it
    this.waits = null; // the text of the last wish, until it is decided
    this.due = null; // the timer of the next wish
    this.box = this.kind === 'bool'
      ? make('button', {type: 'button'})
      : make('input', {type: 'text', autocomplete: 'off', spellcheck: false});
    this.box.inputMode = this.kind === 'number' ? 'decimal' : '';
    if (this.kind !== 'str') {
      this.box.setAttribute('role', this.kind === 'bool' ? 'switch' : 'spinbutton');
    }
    this.box.dataset.number = number.number;
    this.literal = make('s', {hidden: true});
    this.stand(number);
    this.show({text: number.token, changed: false, value: '', minimum: '', maximum: '', fixed: '', hint: ''});
    const on = (kind, handle) => this.box.addEventListener(kind, handle.bind(this));
    on('pointerdown', this.takeHold);
    on('mousedown', event => this.drag && event.preventDefault()); // no text is selected meanwhile
    on('pointermove', this.pull);
    on('pointerup', this.letGo);
    on('lostpointercapture', this.letGo); // whatever the reason
    on('pointerenter', () => send({hover: number.number}));
    on('pointerleave', () => send({hover: document.activeElement?.dataset.number ?? null}));
    on('focus', this.enter);
    on('blur', this.leave);
    on('input', this.type);
    on('click', this.toggle);
    on('keydown', this.press);
  }

  // Take in where it stands now, and how it is written there.
  stand(number) {
    this.number = number;
    this.box.setAttribute('aria-label', `${number.name}, line ${number.line}`);
    this.literal.textContent = number.token || '\'\'';
  }

  // A person's hand is on it: as long as its box stays where it is in the page, it keeps focus and mouse.
  get isHeld() {
    return this.drag !== null || document.activeElement === this.box;
  }

  // It is not in the source any more: nobody has said yet that what was typed is to be taken.
  drop() {
    if (this.isTyped) {
      said.textContent = `${this.number.name} is not marked any more: ${this.box.value} is not taken`;
    }
    this.isTyped = false;
    this.drag = null;
  }

  // Show what is in force; what a hand has typed or dragged stays until it is decided.
  show(known) {
    this.known = known;
    this.box.readOnly = known.fixed !== '';
    this.box.title = [this.number.name, known.fixed, known.hint].filter(Boolean).join('\n');
    this.box.setAttribute('aria-readonly', this.box.readOnly);
    const {value, minimum, maximum} = known;
    const told = {
      bool: {'aria-checked': value},
      number: {'aria-valuenow': value, 'aria-valuemin': minimum, 'aria-valuemax': maximum},
      str: {},
    };
    for (const [name, one] of Object.entries(told[this.kind])) {
      one === '' ? this.box.removeAttribute(name) : this.box.setAttribute(name, one);
    }
    this.literal.hidden = !known.changed;
    this.box.classList.toggle('changed', !this.literal.hidden);
    if (!this.isTyped && this.drag === null && this.waits === null) {
      this.write(known.text);
    }
  }

  write(shown) {
    if (this.kind === 'bool') {
      this.box.textContent = shown;
      return;
    }
    this.box.value = shown;
    this.box.style.width = `${Math.max(shown.length, 1)}ch`;
    if (this.isTaken) {
      this.box.select();
    }
  }

  wish(wanted = this.box.value) {
    clearTimeout(this.due);
    this.due = null;
    this.waits = wanted;
    said.textContent = '';
    if (!send({wish: {number: this.number.number, text: this.waits, turn}})) {
      said.textContent = `${this.number.name} is not changed: ${UNREACHABLE}`;
      this.decided(this.waits);
    }
  }

  decided(shown) {
    if (this.waits === shown) {
      this.waits = null;
      this.show(this.known);
    }
  }

  // Have a truth value be the other one than it is, or will be.
  toggle() {
    if (this.kind === 'bool' && !this.box.readOnly) {
      turn += 1;
      this.wish(String((this.waits ?? this.known.value) !== 'true'));
    }
  }

  // Move it by steps of its last digit, within its bounds.
  step(from, steps) {
    const moved = stepped(from, steps) ?? stepped(this.known.value, steps);
    if (moved === null || this.box.readOnly) {
      return;
    }
    const {minimum, maximum} = this.known;
    const isBelow = minimum !== '' && Number(moved) < Number(minimum);
    const isAbove = maximum !== '' && Number(moved) > Number(maximum);
    this.write(isBelow ? minimum : isAbove ? maximum : moved);
    this.waits = this.box.value;
    this.due ??= setTimeout(() => this.wish(), WISH_PERIOD);
  }

  takeHold(event) {
    const isEdited = document.activeElement === this.box && !this.isTaken;
    if (this.kind === 'number' && event.button === 0 && !isEdited) {
      document.activeElement?.blur(); // one number is held at a time
      this.drag = {x: event.clientX, text: this.box.value, hasMoved: false};
      this.box.setPointerCapture(event.pointerId);
      turn += 1;
    }
  }

  pull(event) {
    const steps = this.drag && Math.trunc((event.clientX - this.drag.x) / STEP_WIDTH);
    if (steps || this.drag?.hasMoved) {
      this.drag.hasMoved = true;
      this.step(this.drag.text, steps);
    }
  }

  letGo() {
    const drag = this.drag;
    this.drag = null;
    if (drag?.hasMoved && this.waits !== null) {
      this.wish();
    } else if (drag && !drag.hasMoved) {
      this.box.focus();
      this.box.select();
    }
    if (isBehind) {
      showDocument();
    }
  }

  enter() {
    turn += 1;
    send({hover: this.number.number});
  }

  leave() {
    this.isTaken = false;
    this.take();
    if (this.due !== null) {
      this.wish();
    }
    send({hover: null});
  }

  type() {
    this.isTaken = false;
    this.isTyped = !this.box.readOnly;
    this.write(this.box.value);
  }

  // Take what was typed.
  take() {
    if (this.isTyped) {
      this.isTyped = false;
      turn += 1;
      this.wish();
    }
  }

  press(event) {
    const steps = this.kind === 'number' && {ArrowUp: 1, ArrowDown: -1}[event.key];
    if (steps) {
      event.preventDefault();
      this.isTyped = false;
      this.step(this.box.value, steps);
    } else if (event.key === 'Enter') {
      this.take();
      this.isTaken = this.kind !== 'bool';
      this.isTaken && this.box.select();
    } else if (event.key === 'Escape') {
      this.isTyped = false;
      this.show(this.known);
      this.box.blur();
    }
  }
}

function showFiles() {
  const names = state.files.map(({file}) => file.split('/').pop());
  tabs.replaceChildren(...state.files.map(({file, nodes}, index) => {
    const tab = make('button', {type: 'button', title: file}, names[index], make('small', {}, nodes.join(' ')));
    tab.setAttribute('role', 'tab');
    tab.setAttribute('aria-controls', 'text');
    tab.dataset.file = file;
    tab.addEventListener('click', () => open(file));
    return tab;
  }));
  opened ||= state.files[0]?.file ?? '';
  if (state.document?.file !== opened && state.files.some(({file}) => file === opened)) {
    open(opened);
  }
  if (!state.files.some(({file}) => file === opened)) {
    const name = opened.split('/').pop();
    const why = name ? `No node runs that has numbers in ${name}.` : 'Waiting for a node whose numbers stand in a file.';
    notes.replaceChildren(make('li', {}, why));
  }
  showOpened();
}

function open(file) {
  opened = file;
  showDiff(null);
  send({open: file});
  showOpened();
}

function showOpened() {
  for (const tab of tabs.children) {
    tab.setAttribute('aria-selected', tab.dataset.file === opened);
  }
  text.setAttribute('aria-label', opened.split('/').pop() || 'Source');
}

// The pieces of a line: text, and the fields of the numbers in it.
function pieces(line, numbers) {
  const characters = Array.from(line);
  const made = [];
  let done = 0;
  for (const number of numbers.sort((one, other) => one.column - other.column)) {
    const field = fields.get(number.number);
    made.push(characters.slice(done, number.column - 1).join(''), field.box, field.literal);
    done = number.column - 1 + Array.from(number.token).length;
  }
  return [...made, characters.slice(done).join('')];
}

// Give a part of the page other children; one of them, if it is there already, stays where it is.
function fill(parent, children, kept) {
  const at = children.indexOf(kept);
  if (at === -1) {
    parent.replaceChildren(...children);
    return;
  }
  [...parent.childNodes].filter(child => child !== kept).forEach(child => child.remove());
  kept.before(...children.slice(0, at));
  kept.after(...children.slice(at + 1));
}

// The fields of the numbers of the document: those that are there already stay.
function keepFields(numbers) {
  const there = new Map(numbers.map(({number, type}) => [number, kindOf(type)]));
  for (const [name, field] of fields) {
    if (there.get(name) !== field.kind) {
      field.drop();
      fields.delete(name);
    }
  }
  for (const number of numbers) {
    fields.get(number.number)?.stand(number);
    fields.has(number.number) || fields.set(number.number, new Field(number));
  }
}

function showDocument() {
  isBehind = [...fields.values()].some(field => field.drag !== null);
  if (isBehind) {
    return;
  }
  const known = state.document;
  const place = known?.file === text.dataset.file ? text.scrollTop : 0;
  const byLine = new Map();
  for (const number of known?.numbers ?? []) {
    byLine.set(number.line, [...byLine.get(number.line) ?? [], number]);
  }
  keepFields(known?.numbers ?? []);
  const held = [...fields.values()].find(field => field.isHeld)?.box;
  const heldLine = held?.parentNode;
  const lines = (known?.text ?? '').split(/\r\n|\r|\n/).map((line, index) => {
    const inside = pieces(line, byLine.get(index + 1) ?? []);
    const made = held && inside.includes(held) ? heldLine : make('div', {className: 'line'});
    fill(made, inside, held);
    made.dataset.line = index + 1;
    return made;
  });
  fill(text, lines, heldLine);
  notes.replaceChildren(...(known?.notes ?? []).map(note => make('li', {}, note)));
  text.dataset.file = known?.file ?? '';
  text.scrollTop = place;
  showSelected();
}

function showSelected() {
  const names = new Set(state.selected.map(({number}) => number));
  for (const [name, field] of fields) {
    field.box.classList.toggle('selected', names.has(name));
  }
  if (follows && text.dataset.file === opened) {
    follows = false;
    const here = state.selected.map(({number}) => fields.get(number)).filter(Boolean);
    const changed = here.filter(field => field.known.changed);
    const wanted = changed.length ? changed : here;
    if (!wanted.some(({box}) => isInSight(box))) {
      wanted[0]?.box.scrollIntoView({block: 'center'});
    }
  }
}

// Whether a box stands in the part of the source that is seen.
function isInSight(box) {
  const [inside, around] = [box, text].map(element => element.getBoundingClientRect());
  return inside.top >= around.top && inside.bottom <= around.bottom;
}

// Open the file of what was selected, if this is the person who did it: the mouse is over the view.
function followSelected() {
  const first = state.selected[0];
  if (first && view.matches(':hover')) {
    follows = true;
    if (first.file !== opened) {
      open(first.file);
    }
  }
  showSelected();
}

// Show what saving would write over the source; null for the source itself.
function showDiff(shown) {
  const isShown = shown?.file === opened;
  const hadFocus = diff.contains(document.activeElement) || document.activeElement === save;
  let [before, after] = [0, 0];
  diff.replaceChildren(...(isShown ? shown.lines : []).map(([sign, content]) => {
    before += sign === '+' ? 0 : 1;
    after += sign === '-' ? 0 : 1;
    const line = make('div', {className: 'line'}, make({'+': 'ins', '-': 'del'}[sign] ?? 'span', {}, sign + content));
    line.dataset.line = sign === '+' ? after : before;
    return line;
  }));
  diff.hidden = save.hidden = !isShown;
  save.disabled = false;
  text.inert = isShown;
  show.setAttribute('aria-pressed', isShown);
  if (isShown) {
    diff.querySelector('del, ins').scrollIntoView({block: 'center'});
  } else if (hadFocus) {
    show.focus();
  }
}

// Ask for something that concerns the open file.
function ask(kind) {
  said.textContent = send({[kind]: opened}) ? '' : UNREACHABLE;
}

show.addEventListener('click', () => diff.hidden ? ask('diff') : showDiff(null));
save.addEventListener('click', () => {
  save.disabled = true;
  ask('save');
});
panel.addEventListener('keydown', event => event.key === 'Escape' && !diff.hidden && showDiff(null));

function take(message) {
  const {files, document: shown, selected, values = {}, diff: changes, decided, said: words, refused} = message;
  if (shown !== undefined) {
    state.document = shown;
    showDocument();
  }
  if (files !== undefined) {
    state.files = files;
    showFiles();
  }
  if (selected !== undefined) {
    state.selected = selected;
    followSelected();
  }
  for (const [name, known] of Object.entries(values)) {
    fields.get(name)?.show(known);
  }
  if (decided !== undefined) {
    fields.get(decided.number)?.decided(decided.text);
  }
  if (changes !== undefined) {
    showDiff(changes);
  }
  if (words ?? refused) {
    said.textContent = words ?? refused;
  }
}

function connect() {
  socket = new WebSocket(`${location.protocol.replace('http', 'ws')}//${location.host}/source`);
  socket.onmessage = event => take(JSON.parse(event.data));
  socket.onclose = () => {
    showDiff(null);
    setTimeout(connect, RECONNECTION);
    notes.replaceChildren(make('li', {}, UNREACHABLE));
  };
}

// Make the source wider (or, below the view, higher) or narrower: a part of the window.
function resize(part) {
  const percent = Math.round(Math.min(Math.max(part, 0.1), 0.9) * 100);
  document.documentElement.style.setProperty('--panel', `${percent}%`);
  divider.setAttribute('aria-valuenow', percent);
}

const isNarrow = matchMedia('(max-width: 799px)');
divider.addEventListener('pointerdown', event => divider.setPointerCapture(event.pointerId));
divider.addEventListener('pointermove', event => {
  if (divider.hasPointerCapture(event.pointerId)) {
    resize(isNarrow.matches ? 1 - event.clientY / innerHeight : 1 - event.clientX / innerWidth);
  }
});
divider.addEventListener('keydown', event => {
  const steps = {ArrowLeft: 5, ArrowUp: 5, ArrowRight: -5, ArrowDown: -5}[event.key];
  if (steps) {
    event.preventDefault();
    resize((Number(divider.getAttribute('aria-valuenow')) + steps) / 100);
  }
});
resize(0.38);

const isDark = matchMedia('(prefers-color-scheme: dark)').matches;
view.src = ['/?view', location.search.slice(1), isDark && 'darkMode'].filter(Boolean).join('&');
connect();
