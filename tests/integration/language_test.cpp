// The window in English and in German: nothing is untranslated, clipped, nameless or out of reach of the keyboard.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <QAbstractButton>
#include <QAction>
#include <QComboBox>
#include <QDateTime>
#include <QDockWidget>
#include <QGroupBox>
#include <QHeaderView>
#include <QLabel>
#include <QListWidget>
#include <QLocale>
#include <QMenu>
#include <QMenuBar>
#include <QPushButton>
#include <QRegularExpression>
#include <QScreen>
#include <QSettings>
#include <QSpinBox>
#include <QStatusBar>
#include <QStyle>
#include <QStyleOptionComboBox>
#include <QTabBar>
#include <QTest>
#include <QToolButton>
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/phantoms/phantom_bone.hpp"
#include "common/wire/credentials.hpp"
#include "tests/integration/desk.hpp"
#include "tests/support/wait.hpp"
#include "viewer_client/desktop/bone_view.hpp"
#include "viewer_client/desktop/field_sentences.hpp"
#include "viewer_client/desktop/landmark_names.hpp"
#include "viewer_client/desktop/language.hpp"
#include "viewer_client/desktop/library.hpp"
#include "viewer_client/desktop/main_window.hpp"
#include "viewer_client/desktop/menu_keys.hpp"
#include "viewer_client/desktop/structure_names.hpp"
#include "viewer_client/scene/tool_groups.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using test::Desk;
using testing::Contains;
using testing::IsEmpty;
using testing::SizeIs;

constexpr auto kPatience = 60s;

using Faults = std::vector<std::string>;

std::string called(const QWidget& widget) {
  return std::string(widget.metaObject()->className()) + " \"" + widget.objectName().toStdString() + "\"";
}

// How much wider than its place the text is, in pixels. At most 0: all of it is seen.
int excess(const QWidget& widget) {
  const int width = widget.width();
  if (const auto* label = qobject_cast<const QLabel*>(&widget)) {
    const int height = label->wordWrap() ? label->heightForWidth(width) : label->sizeHint().height();
    return std::max(label->wordWrap() ? 0 : label->sizeHint().width() - width, height - label->height());
  }
  if (const auto* list = qobject_cast<const QListWidget*>(&widget))
    return list->sizeHintForColumn(0) - list->viewport()->width();
  if (const auto* header = qobject_cast<const QHeaderView*>(&widget)) {
    int most = 0;
    for (int i = 0; i < header->count(); ++i)
      most = std::max(most, header->sectionSizeHint(i) - header->sectionSize(i));
    return most;
  }
  if (const auto* dock = qobject_cast<const QDockWidget*>(&widget)) {
    int buttons = 0;
    for (const auto* button : dock->findChildren<QAbstractButton*>(QString(), Qt::FindDirectChildrenOnly))
      buttons += button->isVisible() ? button->width() : 0;
    return dock->fontMetrics().horizontalAdvance(dock->windowTitle()) + buttons - width;
  }
  if (const auto* bar = qobject_cast<const QMenuBar*>(&widget)) {
    int right = 0;
    for (QAction* action : bar->actions()) {
      const QRect place = bar->actionGeometry(action);
      if (place.isEmpty()) return width;
      right = std::max(right, place.right());
    }
    return right - width;
  }
  if (const auto* bar = qobject_cast<const QStatusBar*>(&widget)) {
    int right = width;
    for (const auto* label : bar->findChildren<QLabel*>())
      if (label->isVisible() && !label->text().isEmpty()) right = std::min(right, label->x());
    return bar->fontMetrics().horizontalAdvance(bar->currentMessage()) - right;
  }
  if (const auto* combo = qobject_cast<const QComboBox*>(&widget)) {
    QStyleOptionComboBox option;
    option.initFrom(combo);
    const QRect field =
        combo->style()->subControlRect(QStyle::CC_ComboBox, &option, QStyle::SC_ComboBoxEditField, combo);
    int most = 0;
    for (int i = 0; i < combo->count(); ++i)
      most = std::max(most, combo->fontMetrics().horizontalAdvance(combo->itemText(i)) - field.width());
    return most;
  }
  if (qobject_cast<const QAbstractSpinBox*>(&widget) != nullptr || qobject_cast<const QTabBar*>(&widget) != nullptr)
    return widget.sizeHint().width() - width;
  const auto* button = qobject_cast<const QAbstractButton*>(&widget);
  if (button != nullptr && !button->text().isEmpty()) return button->sizeHint().width() - width;
  if (qobject_cast<const QGroupBox*>(&widget) != nullptr) return widget.minimumSizeHint().width() - width;
  return 0;
}

template <class Widget>
std::vector<const Widget*> visible(const QWidget& within) {
  std::vector<const Widget*> found;
  for (const auto* widget : within.findChildren<Widget*>())
    if (widget->isVisibleTo(&within)) found.push_back(widget);
  return found;
}

Faults clipped(const QWidget& window) {
  Faults faults;
  for (const QWidget* widget : visible<QWidget>(window)) {
    if (const int by = excess(*widget); by > 0) faults.push_back(called(*widget) + ": " + std::to_string(by) + " px");
    if (const auto* bar = qobject_cast<const QStatusBar*>(widget); bar != nullptr && excess(*bar) > 0)
      faults.back() += " of \"" + bar->currentMessage().toStdString() + "\"";
    // What does not fit into a bar of tools goes behind this button.
    if (widget->objectName() == "qt_toolbar_ext_button") faults.push_back("a bar of tools is too short");
  }
  for (const auto* menu : window.findChildren<QMenu*>())
    if (menu->sizeHint().width() > menu->screen()->size().width()) faults.push_back(called(*menu));
  return faults;
}

// Each entry has a text and a key of its own, which is a letter in its menu or a short cut.
void add_menu_faults(const QMenu& menu, std::map<QString, const QAction*>& short_cuts, Faults& faults) {
  std::set<QString> letters;
  for (const QAction* action : menu.actions()) {
    if (action->menu() != nullptr) add_menu_faults(*action->menu(), short_cuts, faults);
    if (action->isSeparator()) continue;
    const std::string name = action->text().toStdString();
    if (QString(action->text()).remove('&').trimmed().isEmpty()) faults.push_back("an entry has no text");
    const QString letter = QKeySequence::mnemonic(action->text()).toString();
    const QString keys = action->shortcut().toString();
    if (letter.isEmpty() && keys.isEmpty()) faults.push_back(name + ": no key");
    if (!letter.isEmpty() && !letters.insert(letter).second) faults.push_back(name + ": its letter is taken");
    if (!keys.isEmpty() && short_cuts.try_emplace(keys, action).first->second != action)
      faults.push_back(name + ": its short cut is taken");
  }
}

Faults unreachable(const QMenuBar& bar) {
  Faults faults;
  std::map<QString, const QAction*> short_cuts;
  std::set<QString> letters;
  for (const QAction* action : bar.actions()) {
    const QString letter = QKeySequence::mnemonic(action->text()).toString();
    if (letter.isEmpty() || !letters.insert(letter).second) faults.push_back(action->text().toStdString());
    add_menu_faults(*action->menu(), short_cuts, faults);
  }
  return faults;
}

// Of a label with a name, a screen reader reads that instead of the text.
Faults nameless(const QWidget& window) {
  Faults faults;
  for (const auto* label : visible<QLabel>(window))
    if (!label->text().isEmpty() && !label->accessibleName().isEmpty()) faults.push_back(called(*label) + " is unread");
  for (const auto* button : visible<QAbstractButton>(window))
    if (button->text().isEmpty() && button->accessibleName().isEmpty()) faults.push_back(called(*button));
  return faults;
}

// Every text that the window has for a person.
std::set<QString> texts(const QWidget& window) {
  std::set<QString> found;
  for (const QWidget* widget : window.findChildren<QWidget*>()) {
    for (const QString& text :
         {widget->windowTitle(), widget->toolTip(), widget->accessibleName(), widget->accessibleDescription()})
      found.insert(text);
    if (const auto* label = qobject_cast<const QLabel*>(widget)) found.insert(label->text());
    if (const auto* button = qobject_cast<const QAbstractButton*>(widget)) found.insert(button->text());
    if (const auto* box = qobject_cast<const QGroupBox*>(widget)) found.insert(box->title());
    if (const auto* spin = qobject_cast<const QSpinBox*>(widget)) found.insert(spin->suffix());
    if (const auto* list = qobject_cast<const QListWidget*>(widget))
      for (int i = 0; i < list->count(); ++i) found.insert(list->item(i)->text());
    if (const auto* combo = qobject_cast<const QComboBox*>(widget))
      for (int i = 0; i < combo->count(); ++i) found.insert(combo->itemText(i));
    if (const auto* bar = qobject_cast<const QStatusBar*>(widget)) found.insert(bar->currentMessage());
  }
  for (const QAction* action : window.findChildren<QAction*>())
    for (const QString& text : {action->text(), action->toolTip(), action->statusTip()}) found.insert(text);
  std::set<QString> plain;
  for (QString text : found) plain.insert(text.remove('&').trimmed());
  return plain;
}

// Texts with a word that are the same in both languages, and should not be.
Faults untranslated(const std::set<QString>& english, const std::set<QString>& german) {
  const std::set<QString> same{"Osteon", "English", "Deutsch", "System", "Phantom – Osteon", "Axial"};
  const QRegularExpression word("[A-Za-z]{3}"), quantity("^-?[0-9.,]+ \\S+$");
  Faults faults;
  for (const QString& text : german)
    if (english.contains(text) && !same.contains(text) && text.contains(word) && !text.contains(quantity))
      faults.push_back(text.toStdString());
  return faults;
}

class LanguageTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { desk_ = std::make_unique<Desk>(); }
  static void TearDownTestSuite() { desk_.reset(); }

  void SetUp() override {
    ASSERT_TRUE(desk_->stands()) << "Xvfb, of Debian's package xvfb, did not start";
    QSettings().clear();
  }
  void TearDown() override {
    window_.reset();
    speak("en");
  }

  template <class Condition>
  [[nodiscard]] bool until(Condition condition) {
    const auto deadline = std::chrono::steady_clock::now() + test::stretched(kPatience);
    while (!condition()) {
      if (std::chrono::steady_clock::now() > deadline) return false;
      QTest::qWait(20);
    }
    return true;
  }
  // It gets the size and the panels of the window before it, as at a next start.
  void open_window(const char* language) {
    if (window_) window_->close();
    window_.reset();
    speak(language);
    window_ = std::make_unique<MainWindow>();
    window_->show();
    ASSERT_TRUE(QTest::qWaitForWindowExposed(window_.get(), 30000));
    QTest::qWait(100);
  }
  void open_bone() {
    window_->practise(desk_->bone());
    const auto* view = window_->findChild<BoneView*>("bone");
    ASSERT_TRUE(until([&] { return view->surface_shown(); }));
    const auto* device = window_->findChild<QLabel*>("device");
    ASSERT_TRUE(until([&] { return device->text() == QCoreApplication::translate("MainWindow", "Pointer"); }));
  }
  // A session with the longest title among those of the examples.
  static void remember_session() {
    RecentEntry entry;
    for (const ExampleBone& bone : example_bones())
      if (bone.title.size() > entry.name.size()) entry.name = bone.title;
    entry.bone = desk_->bone();
    entry.session = desk_->temp().path() / "session";
    entry.opened = QDateTime({2026, 11, 30}, {23, 59, 59});
    remember(entry);
  }
  void expect_whole(const std::string& where) {
    QCoreApplication::sendPostedEvents();  // a text that has just changed asks for another width
    EXPECT_THAT(clipped(*window_), IsEmpty()) << where;
    EXPECT_THAT(unreachable(*window_->menuBar()), IsEmpty()) << where;
    EXPECT_THAT(nameless(*window_), IsEmpty()) << where;
  }
  // Takes one tool of each group after the other. Returns all texts that were seen.
  [[nodiscard]] std::set<QString> take_tools(const std::string& language) {
    std::set<QString> seen;
    auto* view = window_->findChild<BoneView*>("bone");
    const auto* spindle = window_->findChild<QLabel*>("spindle");
    const int width = view->width();
    for (const ToolGroup& group : tool_groups()) {
      auto* button = window_->findChild<QToolButton*>(QString::fromStdString(std::string(group.name)));
      QTest::mouseClick(button, Qt::LeftButton);
      const QPoint middle = view->mapTo(window_.get(), view->rect().center());
      QTest::mouseMove(window_->windowHandle(), middle + QPoint(1, 0));
      QTest::mouseMove(window_->windowHandle(), middle);
      EXPECT_TRUE(until([&] { return spindle->text() != "–"; })) << "the gauges show nothing";
      QTest::qWait(150);
      EXPECT_EQ(view->width(), width) << "a change of the tool moves the picture";
      expect_whole(language + ", " + std::string(group.name));
      seen.merge(texts(*window_));
    }
    return seen;
  }

  static std::unique_ptr<Desk> desk_;
  std::unique_ptr<MainWindow> window_;
};
std::unique_ptr<Desk> LanguageTest::desk_;

TEST_F(LanguageTest, TheStartPageIsWholeInBothLanguages) {
  std::map<std::string, std::set<QString>> seen;
  for (const char* language : {"en", "de"}) {
    speak(language);
    remember_session();
    open_window(language);
    const auto* recent = window_->findChild<QListWidget*>("recent");
    ASSERT_EQ(recent->count(), 1);
    expect_whole(language);
    seen[language] = texts(*window_);
  }
  EXPECT_GT(seen["de"].size(), 100u);
  EXPECT_THAT(untranslated(seen["en"], seen["de"]), IsEmpty());
}

TEST_F(LanguageTest, TheSurgeryViewIsWholeInBothLanguages) {
  std::map<std::string, std::set<QString>> seen;
  for (const char* language : {"en", "de"}) {
    open_window(language);
    open_bone();
    if (HasFatalFailure()) return;
    expect_whole(language);
    const QSize least = window_->minimumSizeHint();
    EXPECT_TRUE(least.width() <= 1024 && least.height() <= 600)
        << language << ": a small screen has no room for " << least.width() << " by " << least.height();
    seen[language] = take_tools(language);
  }
  EXPECT_THAT(untranslated(seen["en"], seen["de"]), IsEmpty());
}

TEST_F(LanguageTest, TourSoundAndPanelsAreWholeInBothLanguages) {
  std::map<std::string, std::set<QString>> seen;
  for (const char* language : {"en", "de"}) {
    open_window(language);
    window_->findChild<QAction*>("tour_again")->trigger();
    for (int step = 0; step < 5; ++step) {
      QTest::qWait(250);  // the card finds its place
      expect_whole(std::string(language) + ", step " + std::to_string(step + 1));
      seen[language].merge(texts(*window_));
      QTest::keyClick(window_->findChild<QPushButton*>("tour_next"), Qt::Key_Space);
    }
    open_bone();
    if (HasFatalFailure()) return;
    for (const char* panel : {"connections", "slices"}) window_->findChild<QAction*>(panel)->trigger();
    window_->findChild<QAction*>("sound_settings")->trigger();
    const auto* dialog = window_->findChild<QWidget*>("sound_dialog");
    ASSERT_NE(dialog, nullptr);
    QTest::qWait(700);
    expect_whole(language);
    EXPECT_THAT(clipped(*dialog), IsEmpty()) << language;
    EXPECT_THAT(nameless(*dialog), IsEmpty()) << language;
    seen[language].merge(texts(*window_));
    for (const char* panel : {"connections", "slices"}) window_->findChild<QAction*>(panel)->trigger();
  }
  EXPECT_THAT(untranslated(seen["en"], seen["de"]), IsEmpty());
}

// What Osteon itself names: planned axes and structures at risk of its phantoms.
TEST_F(LanguageTest, NamesOfPhantomsAreTranslated) {
  speak("de");
  int names = 0;
  const auto expect_german = [&](const std::string& name) {
    ++names;
    const QStringList english = QString::fromStdString(name).split(", "), german = structure_title(name).split(", ");
    ASSERT_EQ(english.size(), german.size());
    for (int part = 0; part < english.size(); ++part)
      EXPECT_NE(english[part].toStdString(), german[part].toStdString()) << name;
  };
  for (const std::string_view kind : phantoms::kBoneKinds) {
    phantoms::BoneRecipe recipe;
    recipe.kind = kind;
    const auto bone = phantoms::make_bone(recipe);
    ASSERT_TRUE(bone) << kind;
    for (const PlannedAxis& axis : (*bone)->anatomy().axes) expect_german(axis.name);
    for (const phantoms::Structure& structure : (*bone)->structures()) expect_german(structure.name);
  }
  EXPECT_GT(names, 30);
  EXPECT_EQ(structure_title("my own structure"), "my own structure");
  speak("en");
  EXPECT_EQ(structure_title("femur, mechanical axis"), "femur, mechanical axis");
}

// A case has the same names in each language, so it has the same hash.
TEST_F(LanguageTest, StandardLandmarksAreSeenInGermanAndStoredInEnglish) {
  const QStringList english = suggested_landmarks();
  EXPECT_EQ(english[1], "Greater trochanter");
  speak("de");
  const QStringList german = suggested_landmarks();
  ASSERT_EQ(german.size(), english.size());
  for (int i = 0; i < german.size(); ++i) {
    EXPECT_NE(german[i], english[i]);
    EXPECT_EQ(landmark_name(german[i] + " "), english[i].toStdString());
    EXPECT_EQ(landmark_title(english[i].toStdString()), german[i]);
  }
  EXPECT_EQ(german[1], "Großer Rollhügel");
  EXPECT_EQ(landmark_name("Meine Marke"), "Meine Marke");
  EXPECT_EQ(landmark_title("Meine Marke"), "Meine Marke");
  speak("en");
}

TEST_F(LanguageTest, SentencesNameFieldsAndNoOptions) {
  EXPECT_EQ(with_fields("nothing listens at x:1; give with --server the address that it printed"),
            "nothing listens at x:1; give in the field “Server, HOST:PORT” the address that it printed");
  EXPECT_EQ(with_fields("there is none; choose a lower --threshold or a smaller --pitch"),
            "there is none; choose a lower value in the field “Threshold”");
  EXPECT_EQ(with_fields("--server nowhere is not HOST:PORT"), "the server nowhere is not HOST:PORT");
  EXPECT_EQ(with_fields("see whether --server is right"), "see whether the field “Server, HOST:PORT” is right");
  EXPECT_EQ(with_fields("/scans/a--server is empty"), "/scans/a--server is empty") << "a name of the user";
  // Of whoever runs the server.
  EXPECT_EQ(with_fields("this server takes no cases; start it with --uploads FOLDER"),
            "this server takes no cases; start it with --uploads FOLDER");
  // One credential alone, and plain text to another machine.
  const auto half = wire::client_credentials({.plain = false, .certificates = "/nowhere", .ticket = ""});
  ASSERT_FALSE(half);
  const auto far = wire::channel_credentials({}, "192.0.2.1:1");
  ASSERT_FALSE(far);
  // Folders that are taken for that of a person.
  const std::filesystem::path certs = desk_->temp() / "certs", ticket = certs / "ticket";
  for (const char* name : {"server", "authority/people"}) std::filesystem::create_directories(certs / name);
  std::ofstream(certs / "server" / "server.key") << "key";
  std::ofstream(ticket) << "ticket";
  for (const char* name : {"server", "authority"}) {
    const auto other = wire::client_credentials({.plain = false, .certificates = certs / name, .ticket = ticket});
    ASSERT_FALSE(other);
    const QString shown = sentence_of(other.error());
    EXPECT_FALSE(shown.contains("--")) << shown.toStdString();
    EXPECT_TRUE(shown.contains("give that of a person in the field “Folder of your certificate”"))
        << shown.toStdString();
  }
  speak("de");
  for (const Error& error : {half.error(), far.error()}) {
    const QString shown = sentence_of(error);
    EXPECT_FALSE(shown.contains("--")) << shown.toStdString();
    EXPECT_TRUE(shown.contains("“Datei Ihres Tickets”")) << shown.toStdString();
  }
  speak("en");
}

TEST_F(LanguageTest, ShortCutsAreTheSameInBothLanguages) {
  std::map<std::string, std::map<QString, QKeySequence>> keys;
  for (const char* language : {"en", "de"}) {
    open_window(language);
    for (const QAction* action : window_->findChildren<QAction*>())
      if (!action->shortcut().isEmpty()) keys[language][action->objectName()] = action->shortcut();
  }
  EXPECT_GT(keys["en"].size(), 15u);
  EXPECT_EQ(keys["en"], keys["de"]);
}

TEST_F(LanguageTest, TheFirstLanguageOfTheSystemThatTheWindowSpeaksCounts) {
  EXPECT_EQ(spoken_language({}, {"de-AT", "en"}), "de");
  EXPECT_EQ(spoken_language({}, {"en-GB", "de"}), "en");
  EXPECT_EQ(spoken_language({}, {"fr-FR", "de-DE", "en"}), "de");
  EXPECT_EQ(spoken_language({}, {"fr-FR"}), "en");
  EXPECT_EQ(spoken_language({}, {"C"}), "en");
  EXPECT_EQ(spoken_language("en", {"de-DE"}), "en");
  EXPECT_EQ(spoken_language("de", {"en-US"}), "de");
}

TEST_F(LanguageTest, NumbersFollowTheLanguage) {
  speak("de");
  EXPECT_EQ(QLocale().toString(2.5), "2,5");
  speak("en");
  EXPECT_EQ(QLocale().toString(2.5), "2.5");
}

TEST_F(LanguageTest, TheMenuKeepsTheChoice) {
  open_window("en");
  const auto action = [&](const char* name) { return window_->findChild<QAction*>(name); };
  EXPECT_TRUE(action("language_system")->isChecked());
  action("language_de")->trigger();
  EXPECT_EQ(chosen_language(), "de");
  EXPECT_EQ(window_->statusBar()->currentMessage(), "The choice takes effect at the next start.");
  open_window("de");
  EXPECT_TRUE(action("language_de")->isChecked());
  EXPECT_FALSE(action("language_system")->isChecked());
  action("language_system")->trigger();
  EXPECT_EQ(chosen_language(), QString());
}

TEST_F(LanguageTest, KeysOfMenusAreLettersThatAreFree) {
  QMenu menu;
  for (const char* text : {"&Drill", "Drill", "Round drill", "1/8 inch", "ddd", "…"}) menu.addAction(text);
  add_menu_keys(menu);
  QStringList found;
  for (const QAction* action : menu.actions()) found += action->text();
  // The beginnings of both words are taken, and then every letter of "ddd".
  EXPECT_EQ(found, (QStringList{"&Drill", "D&rill", "R&ound drill", "&1/8 inch", "ddd", "…"}));
}

// The checks above can fail.
TEST_F(LanguageTest, TextsWithoutRoomAreNoticed) {
  QWidget window;
  window.resize(400, 300);
  auto* label = new QLabel("Vorschub je Umdrehung", &window);
  auto* wrapped = new QLabel("Vorschub je Umdrehung", &window);
  wrapped->setWordWrap(true);
  auto* button = new QPushButton("Abbrechen", &window);
  auto* combo = new QComboBox(&window);
  combo->addItem("Zylindrische Außenfräse 46 mm");
  auto* spin = new QSpinBox(&window);
  spin->setSuffix(" U/min");
  auto* list = new QListWidget(&window);
  list->addItem("Schädel eines Menschen, aus dem CT");
  auto* tabs = new QTabBar(&window);
  tabs->addTab("Messwerte");
  auto* group = new QGroupBox("Messwerte", &window);
  auto* status = new QStatusBar(&window);
  status->showMessage("Die Wahl gilt ab dem nächsten Start.");
  auto* bar = new QMenuBar(&window);
  bar->addMenu("&Bearbeiten");
  const std::vector<QWidget*> widgets{label, wrapped, button, combo, spin, list, tabs, group, status, bar};
  for (QWidget* widget : widgets) widget->resize(390, 60);
  window.show();
  ASSERT_TRUE(QTest::qWaitForWindowExposed(&window, 30000));
  for (QWidget* widget : widgets) {
    widget->resize(390, 60);
    EXPECT_THAT(clipped(window), IsEmpty());
    widget->resize(12, 12);
    EXPECT_THAT(clipped(window), Contains(testing::StartsWith(called(*widget)))) << called(*widget);
    widget->resize(390, 60);
  }
}

TEST_F(LanguageTest, MenusWithoutKeysAreNoticed) {
  QMenuBar bar;
  QMenu* menu = bar.addMenu("&Datei");
  QAction* open = menu->addAction("&Öffnen");
  QAction* save = menu->addAction("&Speichern");
  EXPECT_THAT(unreachable(bar), IsEmpty());
  save->setText("Speichern");
  EXPECT_THAT(unreachable(bar), SizeIs(1)) << "no key";
  save->setShortcut(QKeySequence("Ctrl+S"));
  EXPECT_THAT(unreachable(bar), IsEmpty());
  open->setShortcut(QKeySequence("Ctrl+S"));
  EXPECT_THAT(unreachable(bar), SizeIs(1)) << "the same short cut";
  open->setShortcut({});
  save->setText("&Öffnen…");
  EXPECT_THAT(unreachable(bar), SizeIs(1)) << "the same letter";
  save->setText("");
  EXPECT_THAT(unreachable(bar), SizeIs(1)) << "no text";
  save->setText("&Speichern");
  bar.addMenu("&Drucken");
  EXPECT_THAT(unreachable(bar), SizeIs(1)) << "two menus with the same letter";
}

TEST_F(LanguageTest, NamelessAndUntranslatedTextsAreNoticed) {
  QWidget window;
  auto* button = new QToolButton(&window);
  EXPECT_THAT(nameless(window), SizeIs(1));
  button->setAccessibleName("Bohrer");
  EXPECT_THAT(nameless(window), IsEmpty());
  auto* label = new QLabel("2,5 mm", &window);
  EXPECT_THAT(nameless(window), IsEmpty());
  label->setAccessibleName("Tiefe");
  EXPECT_THAT(nameless(window), SizeIs(1));
  EXPECT_THAT(untranslated({"Depth", "5 N", "Osteon"}, {"Depth", "5 N", "Osteon"}), SizeIs(1));
}

}  // namespace
}  // namespace osteon
