// Keys for the entries of menus: each entry can be reached with Alt and letters, also those whose text has no key.
#pragma once

class QMenu;

namespace osteon {

// Gives a key to each entry of the menu and of its submenus that has none. No two entries of a menu get the same key. A
// key is the first free letter or digit of a word, otherwise of the text. Where all are taken, the entry has none.
void add_menu_keys(QMenu& menu);

}  // namespace osteon
