// Keeps a room in a journal: writes what it decides, and makes it again from that.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>

#include "server/journal/journal.hpp"
#include "server/net/journal_rows.hpp"
#include "server/room/room.hpp"

namespace osteon {

struct KeptRoom;

// Any thread.
class RoomKeeper {
 public:
  struct Options {
    std::string name = "room";          // of a new one
    CutLimits limits;
    std::shared_ptr<ToolBox> tools;     // that a new one begins with; null: the built-in ones
    JournalOptions journal;
  };
  // Goes on with the journal's room, up to the last row that anyone was told of, or makes a new one where there is no such
  // file. `progress` hears the fraction of the rows replayed. Errors: those of Journal::open; unsupported (of another case,
  // kernel or release); invalid_input (rows that cannot be: then recover). A journal that is closed to rows still gives its
  // room, which takes none.
  [[nodiscard]] static Result<KeptRoom> open(const std::filesystem::path& file, const Case& bone, const Options& options,
                                             const std::function<void(double)>& progress = {});

  // Returns when the rows are safe on the disk: for a Committer. Places go on from the last one.
  [[nodiscard]] Result<void> write(std::span<const RoomRow> rows);
  [[nodiscard]] JournalHead head() const;
  // Rises with every opening.
  [[nodiscard]] std::uint64_t server_epoch() const { return server_epoch_; }
  // Rows that were evaluated again when it was opened.
  [[nodiscard]] std::uint64_t evaluated() const { return evaluated_; }
  // The pseudonym under which rows know this person; the same for the same label.
  [[nodiscard]] Result<std::uint32_t> person(const std::string& label);
  // What a client was told was safe: see Journal::check_witness.
  [[nodiscard]] Result<void> check_witness(const JournalHead& witness);
  [[nodiscard]] const RoomGenesis& genesis() const { return genesis_; }

  // All leaves of the room at head(), so that the next opening need not evaluate every cut again.
  [[nodiscard]] Result<void> checkpoint(RoomSeq place, std::span<const FieldLeaf> leaves);
  [[nodiscard]] Result<void> close();  // clean: nothing may be written afterwards

 private:
  RoomKeeper(Journal journal, RoomGenesis genesis, double pitch_mm)
      : journal_(std::move(journal)), genesis_(std::move(genesis)), pitch_mm_(pitch_mm) {}
  // Of the newest checkpoint that can be read; nothing where there is none.
  struct Fields {
    RoomSeq place;
    std::vector<FieldLeaf> leaves;
  };
  [[nodiscard]] Fields newest_fields();
  [[nodiscard]] Result<Room> replay(const Case& bone, const CutLimits& limits, const Fields& fields,
                                    const std::function<void(double)>& progress);

  mutable std::mutex mutex_;
  Journal journal_;
  RoomGenesis genesis_;
  const double pitch_mm_;
  std::uint64_t server_epoch_ = 0, evaluated_ = 0;
};

struct KeptRoom {
  Room room;
  std::unique_ptr<RoomKeeper> keeper;
  bool made = false;              // there was no journal
};

}  // namespace osteon
