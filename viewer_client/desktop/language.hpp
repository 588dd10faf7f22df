// The language of the window: the system's, or the one that the user chose in the menu or by --language.
#pragma once
#include <QString>
#include <QStringList>
#include <functional>

class QMenu;

namespace osteon {

// A language is "en" or "de". Empty: the first of the system's languages that the window speaks, otherwise English.
[[nodiscard]] QString spoken_language(const QString& choice, const QStringList& system_languages);

// What the user chose in the menu. It is kept in the settings.
[[nodiscard]] QString chosen_language();
void choose_language(const QString& language);

// Widgets that are made afterwards have texts and numbers of this language. Needs a QApplication. [GUI thread]
void speak(const QString& choice);

// Fills the menu in which the user chooses. `chosen` gets a sentence that says when the choice takes effect.
void fill_language_menu(QMenu& menu, const std::function<void(const QString& sentence)>& chosen);

}  // namespace osteon
