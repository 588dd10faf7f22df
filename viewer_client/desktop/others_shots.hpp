// The shots of the others in the room: how much each of them has shot, and whose picture the C-arm's screen shows.
#pragma once
#include <QCoreApplication>
#include <QTreeWidget>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "viewer_client/scene/supervision_client.hpp"

namespace osteon {

// What the room says of its people's C-arms.
struct ShotsOfAll {
  AuthorId self{};  // this window; null: not known yet
  std::vector<PersonSeen> people{};
  std::vector<ShotRun> runs{};  // one state of each press, the newest last
};

// A tree: the user's own pictures, then each of the others with their presses, newest first. Nothing is shown of it
// while nobody else has shot. [GUI thread]
class OthersShots : public QTreeWidget {
  Q_DECLARE_TR_FUNCTIONS(OthersShots)

 public:
  // `chosen` gets the press whose last picture is to be shown now. None: the own pictures, unless of_other(). Also when
  // a press goes on.
  using Chosen = std::function<void(const std::optional<ShotRun>&)>;
  explicit OthersShots(Chosen chosen);

  void take(const ShotsOfAll& all);
  void choose_own();
  // No room any more.
  void reset();
  [[nodiscard]] const std::optional<ShotRun>& shown() const { return shown_; }
  // Another person is chosen. Without shown(): the room has no picture of theirs.
  [[nodiscard]] bool of_other() const { return of_other_; }
  // Who shot and which shot: "Ben, shot 12".
  [[nodiscard]] QString title(const ShotRun& run) const;

 private:
  struct PersonRow {
    QTreeWidgetItem* item = nullptr;
    QString name;
    std::map<std::uint64_t, QTreeWidgetItem*, std::greater<>> presses;  // by the number of the first shot
  };
  void take_people(const ShotsOfAll& all);
  void take_runs(const ShotsOfAll& all);
  void show_chosen();
  [[nodiscard]] std::optional<ShotRun> chosen_run() const;

  Chosen chosen_;
  QTreeWidgetItem* own_ = nullptr;
  std::map<AuthorId, PersonRow> people_;
  std::vector<ShotRun> runs_;  // of the others; the newest last
  std::optional<ShotRun> shown_;
  bool of_other_ = false;
};

}  // namespace osteon
