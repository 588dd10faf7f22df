#include "viewer_client/desktop/force_menu.hpp"

#include <QAction>
#include <QActionGroup>
#include <QCoreApplication>
#include <QMenu>
#include <QSettings>
#include <algorithm>
#include <array>

namespace osteon {

namespace {

constexpr const char* kForceKey = "force/choice";

struct ForceEntry {
  const char *words, *meaning, *choice, *name;
};
constexpr std::array<ForceEntry, 3> kForceEntries{
    {{QT_TRANSLATE_NOOP("Force", "&Proportional"),
      QT_TRANSLATE_NOOP("Force", "All ratios of forces stay. A weak device hides weak forces."), "proportional",
      "force_proportional"},
     {QT_TRANSLATE_NOOP("Force", "&Compressed"),
      QT_TRANSLATE_NOOP("Force", "A logarithm: weak forces keep their ratios, strong ones come closer to each other."),
      "compressed", "force_compressed"},
     {QT_TRANSLATE_NOOP("Force", "&Feed cue"),
      QT_TRANSLATE_NOOP("Force", "A small force, and a vibration that grows with the feed."), "feed-cue",
      "force_feed_cue"}}};

}  // namespace

QString chosen_force() {
  const QString kept = QSettings().value(kForceKey).toString();
  const auto known = std::find_if(kForceEntries.begin(), kForceEntries.end(),
                                  [&](const ForceEntry& entry) { return kept == entry.choice; });
  return known == kForceEntries.end() ? QString(kForceEntries.front().choice) : kept;
}

void fill_force_menu(QMenu& menu, const std::function<void()>& chosen) {
  const QString when =
      QCoreApplication::translate(
          "Force", "The window's haptic client starts again: the tool leaves the bone for some seconds.") +
      ' ' + QCoreApplication::translate("Force", "Other haptic clients have the option --force-choice.");
  menu.setToolTipsVisible(true);
  auto* group = new QActionGroup(&menu);
  for (const ForceEntry& entry : kForceEntries) {
    QAction* action = group->addAction(QCoreApplication::translate("Force", entry.words));
    action->setObjectName(entry.name);
    action->setToolTip(QString("<p>%1 %2</p>").arg(QCoreApplication::translate("Force", entry.meaning), when));
    action->setCheckable(true);
    action->setChecked(chosen_force() == entry.choice);
    QObject::connect(action, &QAction::triggered, &menu, [choice = QString(entry.choice), chosen] {
      if (chosen_force() == choice) return;
      QSettings().setValue(kForceKey, choice);
      chosen();
    });
    menu.addAction(action);
  }
}

}  // namespace osteon
