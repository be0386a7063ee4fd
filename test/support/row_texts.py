"""Texts of random layouts with rows of a list in them, in Python and YAML, and what edits of the rows make of them."""

import ast

import yaml

from rosslt.files import SourceText, python_row_edits, replaced, yaml_row_edits


def in_yaml(text, path, operation):
    """A YAML text after an operation with the row at a path."""
    content = text.encode()
    edits, _ = yaml_row_edits('a.yaml', content, path, operation)
    return replaced(content, edits).decode()


def done(content, made):
    """A Python content in which something was done with rows; the numbers that were there have to be what they were."""
    changed = replaced(content, made.edits)
    before, now = (SourceText('a.py', text).numbers for text in (content, changed))
    kept = [(place, one) for place, one in enumerate(made.numbers) if one is not None]
    assert len(made.numbers) == len(now)
    assert len({one for _, one in kept}) == len(kept) == min(len(before), len(now))
    assert all(repr(before[one].value) == repr(now[place].value) for place, one in kept)
    return changed


class RowText:
    """A text of a random layout with a list of rows in it, and how its rows are found and read."""

    def __init__(self, chance, is_yaml=None):
        self.chance = chance
        self.newline = chance.choice(['\n', '\r\n'])
        kinds = ['list', 'tuple', 'script'] * (is_yaml is not True) + ['block', 'flow'] * (is_yaml is not False)
        self.kind = chance.choice(kinds)
        self.shape = chance.choice(['list', 'map', 'scalar'] if self.kind != 'script' else ['list', 'scalar'])
        self.is_yaml = self.kind in ('block', 'flow')
        indentation = '' if self.kind == 'script' else chance.choice(['  ', '      '] if self.is_yaml else ['  ', '\t'])
        rows = [self.row(number, indentation) for number in range(chance.randint(2 if self.kind == 'script' else 1, 5))]
        opening = {'list': 'A = [', 'tuple': 'A = (', 'script': 'begin()', 'block': 'A:', 'flow': 'A: ['}[self.kind]
        closing = {'list': ']', 'tuple': ')', 'script': 'end()', 'block': '', 'flow': ' ]'}[self.kind]
        lines = ['# ä', opening]
        self.is_last_bare = chance.random() < 0.5 and len(rows) > 1
        for number, row in enumerate(rows):
            lines += [''] * (chance.random() < 0.2) + [indentation + '# between'] * (chance.random() < 0.2)
            has_comma = self.kind in ('list', 'tuple', 'flow') and not (self.is_last_bare and number == len(rows) - 1)
            comment = chance.choice(['', '', f'  # row, {number}', ' '])
            lines.append(indentation + row + ',' * has_comma + comment)
        lines += [closing] * bool(closing)
        self.text = self.newline.join(lines) + self.newline * (chance.random() < 0.8)

    def number(self):
        return self.chance.choice(['1.50', '-2', '1.0e-3', '0.25', '7']) + self.chance.choice(['', '1'])

    def mark(self, number):
        """The number that a row alone has."""
        return f'1000{number}'

    def row(self, number, indentation):
        mark, one, other = self.mark(number), self.number(), self.number()
        if self.kind == 'script':
            return f'goto({mark}, {one}, x={other})' if self.shape == 'list' else f'goto({mark})'
        dash, quote = ('- ' if self.kind == 'block' else ''), '' if self.is_yaml else "'"
        below = self.newline + indentation + '  '
        gap = self.chance.choice([' ', ' ', below])
        if self.shape == 'scalar':
            return dash + mark
        if self.shape == 'list':
            return f'{dash}[{mark},{gap}{one}, "ä"]'
        if self.kind == 'block' and self.chance.random() < 0.5:
            return f'{dash}x: {mark}{below}y: {one}'
        return f'{dash}{{{quote}x{quote}: {mark},{gap}{quote}y{quote}: {other}}}'

    def read(self, text):
        """(the list, all else that the text says)."""
        if self.is_yaml:
            found = yaml.safe_load(text)
            return found.pop('A'), found
        tree = ast.parse(text)
        if self.kind == 'script':
            return [ast.unparse(one) for one in tree.body[1:-1]], [
                ast.unparse(tree.body[0]),
                ast.unparse(tree.body[-1]),
            ]
        (assigned,) = tree.body
        return list(ast.literal_eval(assigned.value)), type(assigned.value)

    def after(self, text, index, operation):
        """The text after an operation with a row."""
        if self.is_yaml:
            return in_yaml(text, ['A', index], operation)
        tree = ast.parse(text)
        those = tree.body[1:-1] if self.kind == 'script' else tree.body[0].value.elts
        lines = text.replace('\r\n', '\n').split('\n')
        content = text.encode()
        column = len(lines[those[index].lineno - 1].encode()[: those[index].col_offset].decode()) + 2
        return done(content, python_row_edits('a.py', content, those[index].lineno, column, operation)).decode()
