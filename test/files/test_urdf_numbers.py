"""The numbers of a URDF are found where they stand, and one of them is replaced without another one."""

import random
import re
from xml.etree import ElementTree

import pytest

from rosslt import files

ARM = """<?xml version="1.0"?>
<robot name="arm">
  <!-- <joint name="old"><origin xyz="1 2 3"/></joint> -->
  <material name="red"><color rgba="1 0 0 1"/></material>
  <link name="base"/>
  <link name="camera">
    <inertial><origin xyz="0 0 .5"/><mass value="3"/></inertial>
    <visual>
      <origin rpy='0 -0 +1' xyz = "0.1\t0.2
        1e-3"/>
      <geometry><box size="0.05 0.05 0.20"/></geometry>
      <material name="red"><color rgba="1 0 0 0.5"/></material>
    </visual>
    <collision><geometry><cylinder radius="0.05" length="0.05"/></geometry></collision>
    <collision><geometry><sphere radius="2"/></geometry></collision>
  </link>
  <joint name="camera_joint" type="revolute">
    <parent link="base"/><child link="camera"/>
    <axis xyz="0 0 1"/>
    <origin xyz="0.10 0 0.5" note="0.10 > 0"/>
    <limit lower="-2.40" upper="2.4" effort="10" velocity="1E1"/>
    <mimic joint="other" multiplier="2"/>
  </joint>
  <transmission name="t"><joint name="x"><origin xyz="7 7 7"/></joint></transmission>
</robot>
"""
FOUND = {
    'red/rgba/0': '1',
    'red/rgba/1': '0',
    'red/rgba/2': '0',
    'red/rgba/3': '1',
    'camera/inertial/xyz/0': '0',
    'camera/inertial/xyz/1': '0',
    'camera/inertial/xyz/2': '.5',
    'camera/visual/rpy/0': '0',
    'camera/visual/rpy/1': '-0',
    'camera/visual/rpy/2': '+1',
    'camera/visual/xyz/0': '0.1',
    'camera/visual/xyz/1': '0.2',
    'camera/visual/xyz/2': '1e-3',
    'camera/visual/size/0': '0.05',
    'camera/visual/size/1': '0.05',
    'camera/visual/size/2': '0.20',
    'camera/visual/rgba/0': '1',
    'camera/visual/rgba/1': '0',
    'camera/visual/rgba/2': '0',
    'camera/visual/rgba/3': '0.5',
    'camera/collision/0/radius': '0.05',
    'camera/collision/0/length': '0.05',
    'camera/collision/1/radius': '2',
    'camera_joint/xyz/0': '0.10',
    'camera_joint/xyz/1': '0',
    'camera_joint/xyz/2': '0.5',
    'camera_joint/limit/lower': '-2.40',
    'camera_joint/limit/upper': '2.4',
    'camera_joint/limit/effort': '10',
    'camera_joint/limit/velocity': '1E1',
}


def texts(content):
    """{name: how the number is written}."""
    found = files.urdf_numbers(content)
    assert all(float(content[one.start : one.end]) == one.value for one in found)
    return {one.name: content[one.start : one.end].decode() for one in found}


def joint(attributes, name='a', head=''):
    return f'{head}<robot><joint name="{name}"><origin {attributes}/></joint></robot>'.encode()


def edited(content, name, said, value, beside=()):
    """A file afterwards, and why not where it is the same."""
    edits, left = files.urdf_edits('a.urdf', content, [files.UrdfChange(name, said, value, 'it', dict(beside))])
    return files.replaced(content, edits), left[0][1] if left else ''


def test_numbers_have_the_names_of_their_elements():
    assert texts(ARM.encode()) == FOUND


@pytest.mark.parametrize('head', ['', '\ufeff', '<?xml version="1.0" encoding="utf-8"?>\n<!-- ä -->', '<!-- \r\n -->'])
def test_what_stands_in_front_moves_no_number(head):
    content = joint('xyz="1 2 3"', head=head)
    assert texts(content) == {'a/xyz/0': '1', 'a/xyz/1': '2', 'a/xyz/2': '3'}


@pytest.mark.parametrize(
    'word', ['&#49;', '1_0', '0x1', 'nan', 'inf', '1e999', '1,5', '${x}', '$(arg x)', '\u0661', '--1']
)
def test_what_is_no_plain_number_is_left_out(word):
    assert texts(joint(f'xyz="{word} 2 3" rpy="4 5 6"')) == {'a/rpy/0': '4', 'a/rpy/1': '5', 'a/rpy/2': '6'}


@pytest.mark.parametrize('words', ['', '1', '1 2', '1 2 3 4'])
def test_an_attribute_with_another_count_is_left_out(words):
    assert texts(joint(f'xyz="{words}"')) == {}


@pytest.mark.parametrize('name', ['', 'a b', 'a/b', 'a&#10;b'])
def test_an_element_without_a_usable_name_is_left_out(name):
    assert texts(joint('xyz="1 2 3"', name)) == {}


def test_of_two_of_one_name_none_is_found():
    two = '<joint name="a"><origin xyz="1 2 3"/></joint>' * 2
    assert texts(f'<robot>{two}<joint name="b"><limit lower="1"/></joint></robot>'.encode()) == {'b/limit/lower': '1'}
    assert texts(b'<robot><joint name="a"><origin xyz="1 2 3"/><origin xyz="4 5 6"/></joint></robot>') == {}


def test_what_looks_like_an_element_is_none():
    inside = '<![CDATA[<joint name="a"><origin xyz="1 2 3"/></joint>]]><!--<joint name="a"><origin xyz="1 2 3"/>-->'
    content = f'<robot>{inside}<joint name="a"><origin note="xyz=&quot;9&quot;" xyz="4 5 6"/></joint></robot>'
    assert list(texts(content.encode()).values()) == ['4', '5', '6']


@pytest.mark.parametrize(
    ('content', 'reason'),
    [
        (b'', 'it is no XML: no element found in line 1'),
        (b'arm', 'it is no XML: syntax error in line 1'),
        (b'<robot>\n<joint>', 'it is no XML: no element found in line 2'),
        (b'<robot><joint xyz="1" xyz="2"/></robot>', 'it is no XML: duplicate attribute in line 1'),
        (b'<launch/>', 'it is a <launch> instead of a <robot>'),
        ('<robot name="ä"/>'.encode('latin-1'), 'it is not in UTF-8'),
        ('<robot/>'.encode('utf-16'), 'it is not in UTF-8'),
        (b'<?xml version="1.0" encoding="latin-1"?><robot/>', 'its encoding is latin-1 instead of UTF-8'),
        (b'<!DOCTYPE robot [<!ENTITY one "1">]><robot/>', 'it has a <!DOCTYPE>'),
    ],
)
def test_what_is_no_urdf_of_ours_says_why(content, reason):
    with pytest.raises(ValueError, match=f'^{re.escape(reason)}$'):
        files.urdf_numbers(content)
    with pytest.raises(files.FileError, match=re.escape(reason)):
        files.urdf_edits('a.urdf', content, [])


@pytest.mark.parametrize(
    ('old', 'value', 'new'),
    [
        ('0.10', 0.25, '0.25'),
        ('0.10', 2.0, '2.00'),
        ('1', 2.0, '2'),
        ('1', 2.5, '2.5'),
        ('.5', 0.25, '.25'),
        ('1e-3', 2.5e-3, '2.5e-3'),
        ('+1', 3.0, '+3'),
        ('-0', 0.5, '0.5'),
        ('5', 1e300, '1e+300'),
        ('5', 0.1 + 0.2, '0.30000000000000004'),
    ],
)
def test_a_number_keeps_its_manner(old, value, new):
    content = joint(f'xyz="7\t{old}\n7"')
    assert files.with_numbers(content, {'a/xyz/1': value}) == joint(f'xyz="7\t{new}\n7"')


def random_urdf(source):
    """A document in which all that may stand around numbers does."""

    comments = ['', '<!-- ä <origin xyz="1"/> -->']
    shapes = [('box', ('size', 3)), ('cylinder', ('radius', 1), ('length', 1)), ('sphere', ('radius', 1))]

    def number():
        return source.choice(['1', '0.10', '-0', '+1', '.5', '1e-3', '-2.50E+1', '7', f'{source.uniform(-9, 9):.4f}'])

    def blank():
        return source.choice([' ', '  ', '\t', '\n', '\r\n', ' \n '])

    def row(count):
        around = source.choice(['', ' '])
        return around + blank().join(number() for _ in range(count)) + around

    def attribute(name, count):
        quote = source.choice('"\'')
        return f'{blank()}{name}{source.choice(["", " "])}={source.choice(["", " "])}{quote}{row(count)}{quote}'

    def element(name, *attributes):
        those = [attribute(*one) for one in attributes if source.random() < 0.8]
        those += [' note=">"'] * (source.random() < 0.3)
        source.shuffle(those)
        return f'<{name}{"".join(those)}{source.choice(["", " "])}/>{source.choice(comments)}'

    parts = []
    for index in range(source.randrange(1, 5)):
        inner = element('origin', ('xyz', 3), ('rpy', 3)) + element('limit', ('lower', 1), ('upper', 1), ('effort', 1))
        parts.append(f'<joint name="j{index}">{inner}</joint>')
        shape = source.choice(shapes)
        visual = f'<visual>{element("origin", ("xyz", 3))}<geometry>{element(*shape)}</geometry></visual>'
        parts.append(f'<link name="ö{index}">{visual * source.randrange(3)}</link>')
    source.shuffle(parts)
    return f'{source.choice(["", chr(0xFEFF)])}<robot name="ü">{blank().join(parts)}</robot>'.encode()


def parsed(content):
    """All that a parser sees, each attribute word by word."""
    return [
        (one.tag, one.text, {name: text.split() for name, text in one.attrib.items()})
        for one in ElementTree.fromstring(content).iter()
    ]


@pytest.mark.parametrize('seed', range(60))
def test_one_replaced_number_differs_alone(seed):
    source = random.Random(seed)
    content = random_urdf(source)
    before = files.urdf_numbers(content)
    assert before
    for number in source.sample(before, min(4, len(before))):
        value = source.choice([0.25, -3.0, 1e-7, 123456.5, source.uniform(-5, 5)])
        after = files.with_numbers(content, {number.name: value})
        assert {one.name: one.value for one in files.urdf_numbers(after)} == {
            **{one.name: one.value for one in before},
            number.name: value,
        }
        end = number.end + len(after) - len(content)
        assert (after[: number.start], after[end:]) == (content[: number.start], content[number.end :])
        words, others = parsed(content), parsed(after)
        differing = [
            (word, other)
            for one, another in zip(words, others)
            for name, row in one[2].items()
            for word, other in zip(row, another[2][name])
            if word != other
        ]
        assert [float(other) for _, other in differing] == [value]
    several = {one.name: source.uniform(-5, 5) for one in before}
    assert {one.name: one.value for one in files.urdf_numbers(files.with_numbers(content, several))} == several


def test_a_save_writes_the_one_number():
    content = ARM.encode()
    saved, why = edited(content, 'camera_joint/xyz/0', [0.1], 0.25)
    assert (saved, why) == (ARM.replace('"0.10 0 0.5" note', '"0.25 0 0.5" note').encode(), '')
    assert edited(saved, 'camera_joint/xyz/0', [0.1, 0.25], 0.1) == (content, '')
    assert edited(content, 'camera_joint/xyz/0', [0.1], 0.1) == (content, '')


def test_what_somebody_has_edited_is_left():
    content = ARM.encode()
    why = 'it was edited since it was loaded: a.urdf says 0.10 instead of 0.3'
    assert edited(content, 'camera_joint/xyz/0', [0.3], 0.25) == (content, why)
    gone = 'a.urdf has no such number, or not in one place, since it was edited'
    assert edited(content, 'arm_joint/xyz/0', [0.3], 0.25) == (content, gone)


def test_of_several_alike_one_is_written_only_if_none_was_moved():
    numbers = {one.name: [one.value] for one in files.urdf_numbers(ARM.encode())}
    name = 'camera/collision/0/radius'
    beside = {one: numbers[one] for one in files.alike_beside(name, list(numbers))}
    assert list(beside) == ['camera/collision/0/length', 'camera/collision/1/radius']
    assert edited(ARM.encode(), name, [0.05], 0.5, beside)[1] == ''
    moved = ARM.replace('<sphere radius="2"/>', '<sphere radius="3"/>').encode()
    why = 'it is not certain which of several alike it is, as camera/collision/1/radius of a.urdf was edited'
    assert edited(moved, name, [0.05], 0.5, beside) == (moved, why)
