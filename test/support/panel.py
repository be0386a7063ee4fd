"""The source beside the view, as somebody sees and uses it in a browser."""

from selenium.webdriver.common.action_chains import ActionChains

#: The parts of the panel whose text has a contrast of less than 4.5 with what it stands on, which WCAG AA asks for.
_LOW_CONTRASTS = """
const parts = color => color.match(/[0-9.]+/g).map(Number);
const linear = part => part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4;
const luminance = color => {
    const [red, green, blue] = color.slice(0, 3).map(part => linear(part / 255));
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue;
};
const ground = one => {
    const color = parts(getComputedStyle(one).backgroundColor);
    return color[3] === 0 ? ground(one.parentElement) : color;
};
const contrast = one => {
    const both = [luminance(parts(getComputedStyle(one).color)), luminance(ground(one))];
    return (Math.max(...both) + 0.05) / (Math.min(...both) + 0.05);
};
return [...document.querySelectorAll('#source *')].filter(one => contrast(one) < 4.5).map(one => one.outerHTML);
"""


class Panel:
    """The panel beside the view of a browser."""

    def __init__(self, browser):
        self.browser, self.driver = browser, browser.driver

    def open(self, file):
        """Open a file by its tab."""
        selector = f'#tabs button[data-file$="/{file}"]'

        def click():
            self.driver.find_elements('css selector', selector)[0].click()
            return True

        self.browser.wait(click, f'a tab {file}')

    def open_file(self):
        return self.driver.find_element('css selector', '#tabs [aria-selected=true]').get_attribute('data-file')

    def box(self, name):
        """The box of a value."""
        selector = f'#text [aria-label^="{name},"]'
        return self.browser.wait(lambda: self.driver.find_elements('css selector', selector), f'{name} is marked')[0]

    def shows(self, name, shown):
        def is_shown():
            box = self.box(name)
            return (box.text if box.tag_name == 'button' else box.get_attribute('value')) == shown

        self.browser.wait(is_shown, f'{name} is shown as {shown}')

    def shows_former(self, name, shown):
        """Wait until beside the box of a changed value stands what the file says."""
        former = lambda: self.box(name).find_element('xpath', 'following-sibling::s')  # noqa: E731
        self.browser.wait(lambda: former().text == shown, f'{shown} is shown beside {name}')

    def type(self, name, *keys):
        self.box(name).click()
        self.box(name).send_keys(*keys)

    def says(self, text):
        source = lambda: self.browser.text_in('#source')  # noqa: E731
        self.browser.wait(lambda: text in source(), lambda: f'the panel says {text}, it has {source()!r}')

    def line_of(self, name):
        """The text of the line of a number, without the number."""
        return self.driver.execute_script('return arguments[0].parentNode.textContent', self.box(name))

    def scrub(self, name, pixels):
        hand = ActionChains(self.driver, duration=50).click_and_hold(self.box(name))
        for _ in range(abs(pixels) // 4):
            hand.move_by_offset(4 if pixels > 0 else -4, 0)
        hand.release().perform()

    def boxes(self, count):
        """The boxes of the open file, once there are so many."""
        found = self.driver.find_elements('css selector', '#text input')
        return found if len(found) == count else None

    def boxes_of(self, node):
        """The boxes of a node in the open file, once there are some."""
        selector = f'#text input[aria-label^="{node}/"]'
        return self.browser.wait(lambda: self.driver.find_elements('css selector', selector), f'numbers of {node}')

    def prefer(self, scheme):
        """Have the page in the colors of a scheme, `light` or `dark`; '' for that of the browser."""
        features = [{'name': 'prefers-color-scheme', 'value': scheme}]
        self.driver.execute_cdp_cmd('Emulation.setEmulatedMedia', {'features': features})

    def low_contrasts(self):
        """The parts of the panel whose text has too little contrast."""
        return self.driver.execute_script(_LOW_CONTRASTS)
