#include "viewer_client/desktop/page_fields.hpp"

#include <QAbstractSpinBox>
#include <QComboBox>
#include <QKeyEvent>
#include <QLineEdit>

namespace osteon {

namespace {

class PageFields : public QObject {
 public:
  using QObject::QObject;

  bool eventFilter(QObject* watched, QEvent* event) override {
    auto* field = static_cast<QWidget*>(watched);
    const bool leaves = (event->type() == QEvent::ShortcutOverride && leaves_key(*field, *event)) ||
                        (event->type() == QEvent::Wheel && !field->hasFocus());
    if (!leaves) return false;
    event->ignore();  // so it goes to the page
    return true;
  }

 private:
  static bool leaves_key(const QWidget& field, const QEvent& event) {
    const auto& key = static_cast<const QKeyEvent&>(event);
    const bool undo = key.matches(QKeySequence::Undo), redo = key.matches(QKeySequence::Redo);
    const auto* line = qobject_cast<const QLineEdit*>(&field);
    if (const auto* choice = qobject_cast<const QComboBox*>(&field)) line = choice->lineEdit();
    if (line == nullptr) return undo || redo;
    return (undo && !line->isUndoAvailable()) || (redo && !line->isRedoAvailable());
  }
};

}  // namespace

void leave_keys_and_wheel(QWidget& page) {
  auto* fields = new PageFields(&page);
  const auto watch = [fields](QWidget* field) {
    if (field->focusPolicy() == Qt::WheelFocus) field->setFocusPolicy(Qt::StrongFocus);
    field->installEventFilter(fields);
  };
  for (auto* field : page.findChildren<QAbstractSpinBox*>()) watch(field);
  for (auto* field : page.findChildren<QComboBox*>()) watch(field);
  for (auto* field : page.findChildren<QLineEdit*>()) field->installEventFilter(fields);
}

}  // namespace osteon
