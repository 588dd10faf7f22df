// How a haptic device shows force: the user's choice, which is kept in the settings, and its menu.
#pragma once
#include <QString>
#include <functional>

class QMenu;

namespace osteon {

// As --force-choice of osteon-haptic names it.
[[nodiscard]] QString chosen_force();

// Fills the menu in which the user chooses. `chosen` is called after another choice.
void fill_force_menu(QMenu& menu, const std::function<void()>& chosen);

}  // namespace osteon
