"""The man page and --help say the same, and the page is well made."""
import os
import re
import shutil
import subprocess
import unittest

from daemon import LUMEND

COMMANDS = ("serve", "render", "compare", "measure", "export", "state", "token", "photometry", "scenes", "methods")


def text_of(*arguments):
    return subprocess.run([LUMEND, *arguments], capture_output=True, text=True, check=True).stdout


def page_of_each_command():
    """command: its part of the page, as plain text."""
    page = text_of("help", "--man")
    page = page[page.index(".SH DESCRIPTION"):page.index(".SH SIGNALS")].replace(".SH DESCRIPTION", ".SH COMMAND serve")
    parts = re.split(r"(?m)^\.SH COMMAND (\w+)\n", page)
    return {name: plain(text) for name, text in zip(parts[1::2], parts[2::2])}


def plain(roff):
    return re.sub(r"\\f[BIR]", "", roff).replace("\\-", "-").replace("\\&", "").replace("\\e", "\\")


def words_of(text):
    """What is said, whatever the layout: requests of roff, indents and the gaps of columns left out."""
    return re.sub(r"(?m)^\.\w+.*\n|^\.B |\busage: ", lambda m: "", re.sub(r"(?m)^\.B ", "", text)).split()


class ManPage(unittest.TestCase):
    def test_it_names_the_options_of_help_and_no_others(self):
        page = page_of_each_command()
        self.assertEqual(tuple(page), COMMANDS)
        for command in COMMANDS:
            help_options = re.findall(r"(?m)^  (--[\w-]+)", text_of(command, "--help"))
            page_options = re.findall(r"(?m)^\.TP\n(--[\w-]+)", page[command])
            self.assertEqual(page_options, help_options, command)
        self.assertGreater(len(re.findall(r"(?m)^\.TP\n--", page["serve"])), 15)

    def test_it_says_all_that_help_says(self):
        page = page_of_each_command()
        for command in COMMANDS:
            self.assertEqual(words_of(page[command]), words_of(text_of(command, "--help")), command)
            self.assertEqual(text_of("help", command), text_of(command, "--help"), command)

    def test_pages_of_the_other_programs_say_what_their_help_says(self):
        for program in ("lumend-import", "lumend-replay"):
            said = subprocess.run([os.path.join(os.path.dirname(LUMEND), program), "--help"], capture_output=True, text=True, check=True).stdout
            page = subprocess.run([LUMEND, "help", "--man-of", program, "what it is"], input=said, capture_output=True, text=True, check=True).stdout
            self.assertTrue(page.startswith(f".TH {program.upper()} 1 "), page[:60])
            body = page[page.index(".SH DESCRIPTION"):page.index(".SH SEE ALSO")]
            self.assertEqual(words_of(plain(body)), words_of(said))
            for option in re.findall(r"(?m)^  (--[a-z-]+)", said):
                self.assertRegex(plain(body), rf"(?m)^\.TP\n{option}\b")
            self.formatters_are_silent(page)

    def check(self, *command, page):
        done = subprocess.run(command, input=page, capture_output=True, text=True, check=False,
                              env={"PATH": "/usr/bin:/bin", "LC_ALL": "C.UTF-8", "MANWIDTH": "80"})
        self.assertEqual((done.returncode, done.stderr), (0, ""), command)
        return done.stdout

    def formatters_are_silent(self, page):
        """How many there are here; what groff makes of it must name the options."""
        n = 0
        if shutil.which("groff"):
            self.assertIn("--", self.check("groff", "-man", "-ww", "-Tutf8", "-P-c", "-P-b", "-P-u", page=page))
            n += 1
        if shutil.which("mandoc"):
            self.check("mandoc", "-Tlint", "-Wwarning", page=page)
            n += 1
        if shutil.which("man") and shutil.which("groff"):
            self.check("man", "--warnings", "-E", "UTF-8", "-l", "-Tutf8", "-Z", "-", page=page)
            n += 1
        return n

    def test_formatters_have_nothing_to_say(self):
        if self.formatters_are_silent(text_of("help", "--man")) == 0:
            self.skipTest("no groff, man or mandoc here")


if __name__ == "__main__":
    unittest.main()
