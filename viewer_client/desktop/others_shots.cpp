#include "viewer_client/desktop/others_shots.hpp"

#include <QDateTime>
#include <QHeaderView>
#include <QLocale>
#include <QSignalBlocker>
#include <algorithm>
#include <iterator>
#include <set>
#include <string>
#include <utility>

namespace osteon {
namespace {

enum ShotColumn : int { kWho, kCount, kSeconds, kDose, kShotColumns };
constexpr int kRowsInView = 7;

// Only if it differs, so that nothing is drawn or read aloud again.
void set_cell(QTreeWidgetItem& item, int column, const QString& text) {
  if (item.text(column) != text) item.setText(column, text);
}

QString seconds_text(double seconds) { return QLocale().toString(seconds, 'f', 2); }

}  // namespace

OthersShots::OthersShots(Chosen chosen) : chosen_(std::move(chosen)) {
  setObjectName("c_arm_others");
  setAccessibleName(tr("Shots of the others in the room"));
  setToolTip(tr("Of a person the newest picture is shown, of a line below it that press.") + ' ' +
             tr("The picture is made again from the bone and the tools as they are when you choose it."));
  setColumnCount(kShotColumns);
  setHeaderLabels({tr("Pictures of"), tr("Shots"), "s", "Gy cm²"});
  headerItem()->setToolTip(kSeconds, tr("Exposure, seconds"));
  headerItem()->setToolTip(kDose, tr("Dose-area product, nominal"));
  header()->setStretchLastSection(false);
  header()->setSectionResizeMode(QHeaderView::ResizeToContents);
  header()->setSectionResizeMode(kWho, QHeaderView::Stretch);
  setUniformRowHeights(true);
  setMaximumHeight(kRowsInView * fontMetrics().height() * 3 / 2);
  own_ = new QTreeWidgetItem(this, {tr("Mine")});
  setCurrentItem(own_);
  connect(this, &QTreeWidget::currentItemChanged, this, [this] { show_chosen(); });
  hide();
}

void OthersShots::take(const ShotsOfAll& all) {
  {
    const QSignalBlocker quiet(this);
    take_people(all);
    take_runs(all);
  }
  setVisible(!people_.empty());
  show_chosen();
}

void OthersShots::take_people(const ShotsOfAll& all) {
  const auto is_shown = [&](const PersonSeen& person) { return person.author != all.self && person.shots.shots > 0; };
  std::map<std::string, int> bearers;
  for (const PersonSeen& person : all.people)
    if (is_shown(person)) ++bearers[person.name];
  std::set<AuthorId> there;
  for (const PersonSeen& person : all.people) {
    if (!is_shown(person)) continue;
    there.insert(person.author);
    PersonRow& row = people_[person.author];
    if (row.item == nullptr) row.item = new QTreeWidgetItem(this);
    const QString number = '#' + QString::number(person.author.value);
    const QString name = QString::fromStdString(person.name);
    row.name = name.isEmpty() ? number : bearers[person.name] > 1 ? name + ' ' + number : name;
    set_cell(*row.item, kWho, row.name);
    set_cell(*row.item, kCount, QString::number(person.shots.shots));
    set_cell(*row.item, kSeconds, seconds_text(person.shots.exposure_s));
    set_cell(*row.item, kDose, QLocale().toString(person.shots.dose_area_gy_cm2, 'f', 5));
  }
  std::erase_if(people_, [&](const auto& entry) {
    if (there.contains(entry.first)) return false;
    delete entry.second.item;
    return true;
  });
}

void OthersShots::take_runs(const ShotsOfAll& all) {
  // What is looked at stays, also when the room has forgotten it.
  const std::optional<ShotRun>& kept = shown_;
  runs_.clear();
  if (kept && people_.contains(kept->author)) runs_.push_back(*kept);
  for (const ShotRun& run : all.runs) {
    if (!people_.contains(run.author)) continue;
    std::erase_if(runs_, [&](const ShotRun& known) { return same_press(known, run); });
    runs_.push_back(run);
  }
  for (const ShotRun& run : runs_) {
    PersonRow& row = people_.at(run.author);
    const auto [press, is_new] = row.presses.try_emplace(run.first_number, nullptr);
    if (is_new) {
      press->second = new QTreeWidgetItem;
      row.item->insertChild(static_cast<int>(std::distance(row.presses.begin(), press)), press->second);
    }
    const QString time = QDateTime::fromMSecsSinceEpoch(run.last.time_unix_ms).toString("HH:mm:ss");
    const QString last = QString::number(run.last.number);
    set_cell(*press->second, kWho,
             run.shots() == 1 ? tr("Shot %1, %2").arg(last, time)
                              : tr("Shots %1 to %2, %3").arg(QString::number(run.first_number), last, time));
    set_cell(*press->second, kCount, QString::number(run.shots()));
    set_cell(*press->second, kSeconds, seconds_text(run.exposure_s));
  }
  for (auto& [author, row] : people_)
    std::erase_if(row.presses, [&, of = author](const auto& press) {
      const auto is_it = [&](const ShotRun& run) { return run.author == of && run.first_number == press.first; };
      if (std::ranges::any_of(runs_, is_it)) return false;
      delete press.second;
      return true;
    });
}

std::optional<ShotRun> OthersShots::chosen_run() const {
  const QTreeWidgetItem* item = currentItem();
  for (const auto& [author, row] : people_) {
    // Of a person the newest.
    if (row.item == item) {
      const auto newest = std::ranges::find(runs_.rbegin(), runs_.rend(), author, &ShotRun::author);
      return newest != runs_.rend() ? std::optional(*newest) : std::nullopt;
    }
    for (const auto& [first, press] : row.presses)
      if (press == item)
        for (const ShotRun& run : runs_)
          if (run.author == author && run.first_number == first) return run;
  }
  return {};
}

void OthersShots::show_chosen() {
  const std::optional<ShotRun> run = chosen_run();
  const bool of_other = currentItem() != nullptr && currentItem() != own_;
  if (run == shown_ && of_other == of_other_) return;
  shown_ = run;
  of_other_ = of_other;
  chosen_(shown_);
}

void OthersShots::choose_own() { setCurrentItem(own_); }

void OthersShots::reset() {
  choose_own();
  take({});
}

QString OthersShots::title(const ShotRun& run) const {
  const auto row = people_.find(run.author);
  return tr("%1, shot %2").arg(row != people_.end() ? row->second.name : QString(), QString::number(run.last.number));
}

}  // namespace osteon
