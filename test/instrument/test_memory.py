"""A change goes into the memory of a node: it then does what the plain node does in which a hand sets the same names
at the same moment."""

import pytest

from support.memory_oracle import CHANGED, KINDS, LOCAL, OTHER_LOCAL, USES, differences, read_once, said_by

#: How a node may carry a state on that is made of `factor`, in every third round.
STATES = {
    'name': ('x = 2.0', 'x = x * factor', 'x'),
    'sum': ('x = 2.0', 'x += factor', 'x'),
    'attribute': ('class A: pass\na = A()\na.x = 2.0', 'a.x = a.x * factor', 'a.x'),
    'setter': (
        'class A:\n    def put(self, x): self.x = x\na = A()\na.put(2.0)',
        'a.put(a.x * factor)',
        'a.x',
    ),
    'append': ('x = [2.0]', 'x.append(x[-1] * factor)', 'x[-1]'),
    'setattr': ('class A: pass\na = A()\na.x = 2.0', 'setattr(a, "x", a.x * factor)', 'a.x'),
    'update': ('x = dict(x=2.0)', 'x.update(x=x["x"] * factor)', 'x["x"]'),
    'deque': ('x = collections.deque([2.0], 1)', 'x.append(x[0] * factor)', 'x[0]'),
    'function': ('def scaled(y): return y * factor\nx = [2.0]', 'x[0] = scaled(x[0])', 'x[0]'),
    'slice': ('x = np.array([2.0, 1.0])', 'x[:] = x * factor', 'float(x[0])'),
    'out': ('x = np.array([2.0, 1.0])', 'np.multiply(x, factor, out=x)', 'float(x[0])'),
    'array': ('x = np.array([2.0, 1.0])', 'x *= factor', 'float(x[0])'),
    'message': ('x = Point(2.0, 0.0, 0.0)', 'x.x = x.x * factor', 'x.x'),
}


@pytest.mark.parametrize('source', ['parameter', 'literal', 'location'])
def test_what_is_kept_follows(pair, tmp_path, source):
    kept = {kind: (3.25 + number / 64, 7.75 + number / 64) for number, kind in enumerate(KINDS)}

    def parts(name):
        for kind, (before, read, hand) in KINDS.items():
            number, other = kept[kind]
            use = '\n'.join(USES.values()).replace('READ', f'({read})').replace('LIMIT', '5.0')
            yield (
                before.replace('READ', read_once(name, source, number)),
                'pass',
                use,
                hand.replace('HAND', repr(other)),
            )

    plain, tracked = said_by(pair, tmp_path, parts, source, {LOCAL: OTHER_LOCAL, **dict(kept.values())})
    assert all(before != after for before, after in zip(plain[CHANGED - 1], plain[CHANGED]))
    wrong = differences(plain, tracked, ['local variable', *KINDS])
    assert not wrong, wrong[:10]


@pytest.mark.parametrize('source', ['literal', 'location'])
def test_a_state_goes_on_with_the_new_number(pair, tmp_path, source):
    factors = {state: 1.25 + number / 64 for number, state in enumerate(STATES)}

    def parts(name):
        for state, (start, step, read) in STATES.items():
            use = f'if count % 3 == 0:\n    {step}\nsaid = repr({read} * 1.0)'
            names = 'global x' if state in ('name', 'sum', 'array') else 'pass'
            yield (
                f'factor = {read_once(name, source, factors[state])}\n{start}',
                names,
                use,
                'globals()["factor"] = 0.5',
            )

    changes = {LOCAL: OTHER_LOCAL, **dict.fromkeys(factors.values(), 0.5)}
    plain, tracked = said_by(pair, tmp_path, parts, source, changes)
    wrong = differences(plain, tracked, ['local variable', *STATES])
    assert not wrong, wrong[:10]
