#include "viewer_client/desktop/language.hpp"

#include <QAction>
#include <QActionGroup>
#include <QCoreApplication>
#include <QLibraryInfo>
#include <QLocale>
#include <QMenu>
#include <QSettings>
#include <QTranslator>

// Q_INIT_RESOURCE declares a function of the global namespace.
static void load_translation_resource() { Q_INIT_RESOURCE(translations); }

namespace osteon {

namespace {

constexpr const char* kLanguageKey = "window/language";
constexpr const char* kTranslators = "osteon_translators";

// Qt's own words are in a package that may be missing. These few are seen in every session.
[[maybe_unused]] constexpr const char* kWordsOfQt[] = {
    QT_TRANSLATE_NOOP("QPlatformTheme", "OK"),
    QT_TRANSLATE_NOOP("QPlatformTheme", "Cancel"),
    QT_TRANSLATE_NOOP("QShortcut", "Ctrl"),
    QT_TRANSLATE_NOOP("QShortcut", "Shift"),
    QT_TRANSLATE_NOOP("QShortcut", "Home"),
    QT_TRANSLATE_NOOP("QShortcut", "Esc"),
    QT_TRANSLATE_NOOP("QDockWidget", "Float"),
    QT_TRANSLATE_NOOP("QDockWidget", "Undocks and re-attaches the dock widget"),
    QT_TRANSLATE_NOOP("QDockWidget", "Close"),
    QT_TRANSLATE_NOOP("QDockWidget", "Closes the dock widget"),
    QT_TRANSLATE_NOOP("QTabBar", "Scroll Left"),
    QT_TRANSLATE_NOOP("QTabBar", "Scroll Right")};

void add_translator(QObject* owner, const QString& file, const QString& folder) {
  auto* translator = new QTranslator(owner);
  if (translator->load(file, folder)) QCoreApplication::installTranslator(translator);
}

}  // namespace

QString spoken_language(const QString& choice, const QStringList& system_languages) {
  for (const QString& wanted : choice.isEmpty() ? system_languages : QStringList{choice})
    for (const char* language : {"en", "de"})
      if (wanted.section(QChar('-'), 0, 0) == language) return language;
  return "en";
}

QString chosen_language() { return QSettings().value(kLanguageKey).toString(); }

void choose_language(const QString& language) { QSettings().setValue(kLanguageKey, language); }

void speak(const QString& choice) {
  load_translation_resource();
  const QLocale system = QLocale::system();
  const QString language = spoken_language(choice, system.uiLanguages());
  delete QCoreApplication::instance()->findChild<QObject*>(kTranslators);
  if (language == "de") {
    auto* translators = new QObject(QCoreApplication::instance());
    translators->setObjectName(kTranslators);
    add_translator(translators, "qtbase_de", QLibraryInfo::location(QLibraryInfo::TranslationsPath));
    add_translator(translators, "osteon_de", ":/translations");
  }
  // Numbers follow a language that was chosen, but keep the region of a system that speaks it. C speaks English.
  const QLocale::Language wanted = QLocale(language).language();
  const bool fits = system.language() == wanted || (wanted == QLocale::English && system.language() == QLocale::C);
  QLocale::setDefault(choice.isEmpty() || fits ? system : QLocale(wanted));
}

void fill_language_menu(QMenu& menu, const std::function<void(const QString&)>& chosen) {
  struct Entry {
    QString words, language;
    const char* name;
  };
  // A language is called by its own name, so that whoever needs it finds it.
  const Entry entries[] = {{QCoreApplication::translate("Language", "&System"), {}, "language_system"},
                           {QStringLiteral("&English"), "en", "language_en"},
                           {QStringLiteral("&Deutsch"), "de", "language_de"}};
  const QString when = QCoreApplication::translate("Language", "The choice takes effect at the next start.");
  auto* group = new QActionGroup(&menu);
  for (const Entry& entry : entries) {
    QAction* action = group->addAction(entry.words);
    action->setObjectName(entry.name);
    action->setStatusTip(when);
    action->setCheckable(true);
    action->setChecked(chosen_language() == entry.language);
    QObject::connect(action, &QAction::triggered, &menu, [language = entry.language, chosen, when] {
      choose_language(language);
      chosen(when);
    });
    menu.addAction(action);
  }
}

}  // namespace osteon
