"""Checks the German texts of the window against its sources, by Qt's lupdate. OSTEON_SOURCE_DIR: the folder of Osteon.

After a change of a text, this brings the file up to date. Then translate what it marks as unfinished:
  lupdate -no-obsolete -locations none -I . viewer_client/desktop -ts viewer_client/desktop/translations/osteon_de.ts
"""
import os
import re
import shutil
import subprocess
import tempfile
import unittest
import xml.etree.ElementTree as ElementTree
from pathlib import Path

ROOT = Path(os.environ["OSTEON_SOURCE_DIR"])
WINDOW = ROOT / "viewer_client/desktop"
GERMAN = WINDOW / "translations/osteon_de.ts"

# A text of several letters that goes to the screen as it is.
SHOWN = re.compile(
    r"\b(?:set(?:Text|Title|WindowTitle|ToolTip|StatusTip|AccessibleName|AccessibleDescription|Suffix|Prefix"
    r"|PlaceholderText|LabelText)|add(?:Row|Menu|Tab|Action|Item)|showMessage|say|fail|set_notice|heading|Q(?:Label"
    r"|PushButton|CheckBox|RadioButton|GroupBox|DockWidget|Action))\(\s*(?:QString(?:Literal|::fromUtf8)?\(\s*)?"
    r'"((?:[^"\\]|\\.)*[A-Za-z]{2}(?:[^"\\]|\\.)*)"')
PROPER_NAMES = {"Osteon"}


def messages(text):
    """(context, source) -> (translation, its state), of a file of Qt Linguist."""
    return {(context.findtext("name"), message.findtext("source") or ""):
            (message.findtext("translation") or "", message.find("translation").get("type", "finished"))
            for context in ElementTree.fromstring(text).iter("context") for message in context.iter("message")}


def completeness_faults(kept, updated):
    """`kept`: the file of translations. `updated`: the same after lupdate. Both as of messages()."""
    unfinished = [f"{context}: \"{source}\" has no finished German translation"
                  for (context, source), (german, state) in updated.items() if state != "finished" or not german]
    obsolete = [f"{context}: \"{source}\" is in no source any more" for context, source in kept.keys() - updated.keys()]
    return unfinished + sorted(obsolete)


def form(text):
    """What a translation must have in common with its source."""
    return {"placeholders": sorted(re.findall(r"%L?\d", text)),
            "key of a menu": len(re.findall(r"&(?=[^\s&])", text)),
            "ellipsis at the end": text.endswith("…"),
            "tags": re.findall(r"</?\w+", text),
            "blanks at both ends": (text[:1].isspace(), text[-1:].isspace()),
            "three dots for an ellipsis": "..." in text}


def form_faults(found):
    return [f"{context}: \"{source}\" and \"{german}\" differ in: {aspect}"
            for (context, source), (german, _) in found.items()
            for aspect, value in form(source).items() if form(german)[aspect] != value]


def untranslated(code):
    return [text for text in SHOWN.findall(code) if text not in PROPER_NAMES]


class Translations(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.kept = messages(GERMAN.read_text(encoding="utf-8"))

    def updated(self):
        with tempfile.TemporaryDirectory() as folder:
            copy = Path(shutil.copy(GERMAN, folder))
            done = subprocess.run(
                ["lupdate", "-silent", "-no-obsolete", "-locations", "none", "-I", str(ROOT), str(WINDOW), "-ts",
                 str(copy)], capture_output=True, text=True, check=False)
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            return messages(copy.read_text(encoding="utf-8"))

    def test_every_text_has_a_translation(self):
        updated = self.updated()
        self.assertGreater(len(updated), 150)
        self.assertEqual(completeness_faults(self.kept, updated), [])

    def test_translations_have_the_form_of_their_sources(self):
        self.assertEqual(form_faults(self.kept), [])

    def test_every_tool_has_a_german_name(self):
        titles = [re.search(r"^title: (.+)$", file.read_text(encoding="utf-8"), re.M)[1]
                  for file in (ROOT / "common/tools/box").glob("*.yaml")]
        self.assertGreater(len(titles), 20)
        self.assertEqual([title for title in titles if ("Tools", title) not in self.kept], [])

    def test_no_text_goes_past_the_translation(self):
        self.assertEqual([f"{file.name}: {text}" for file in sorted(WINDOW.glob("*.[ch]pp"))
                          for text in untranslated(file.read_text(encoding="utf-8"))], [])


class RulesCanFail(unittest.TestCase):
    HEAD = "<TS><context><name>A</name><message><source>Open</source>"
    TAIL = "</message></context></TS>"

    def test_incomplete_translations_are_noticed(self):
        good = messages(f"{self.HEAD}<translation>Öffnen</translation>{self.TAIL}")
        self.assertEqual(completeness_faults(good, good), [])
        for translation in ("<translation type='unfinished'>Öffnen</translation>", "<translation></translation>"):
            bad = messages(f"{self.HEAD}{translation}{self.TAIL}")
            self.assertEqual(len(completeness_faults(good, bad)), 1, translation)
        self.assertEqual(completeness_faults(good, {}), ["A: \"Open\" is in no source any more"])

    def test_other_forms_are_noticed(self):
        good = {("A", "&Move %1 <b>by %2</b>…"): ("Um <b>%2</b> %1 &bewegen…", "finished")}
        self.assertEqual(form_faults(good), [])
        for source, german in (("%1 of %2", "%1 von %1"), ("&Open", "Öffnen"), ("Open…", "Öffnen"), (" N", "N"),
                               ("Open", "Öffnen…"), ("<b>a</b>", "<b>a"), ("Open", "Öff&nen"), ("a", "b...")):
            self.assertEqual(len(form_faults({("A", source): (german, "finished")})), 1, source)

    def test_untranslated_texts_are_noticed(self):
        for code in ('label->setText("Depth");', 'new QLabel(\n    "Depth")', 'form->addRow("Depth", a)',
                     'say(QString("Saved"))', 'menu.addMenu(QStringLiteral("File"))'):
            self.assertEqual(len(untranslated(code)), 1, code)
        for code in ('label->setText(tr("Depth"));', 'new QLabel("–")', 'new QLabel("Osteon")'):
            self.assertEqual(untranslated(code), [], code)


if __name__ == "__main__":
    unittest.main()
