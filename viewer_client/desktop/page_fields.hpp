// Fields of a page that scrolls and has its own undo.
#pragma once

class QWidget;

namespace osteon {

// From now on, the spin boxes, combo boxes and lines of text in `page` and its dialogs leave to it
// - the keys of undo and redo: number fields always, lines of text where they have nothing to undo;
// - the wheel, unless the field has the keyboard's focus, which the wheel no longer gives.
// [GUI thread]
void leave_keys_and_wheel(QWidget& page);

}  // namespace osteon
