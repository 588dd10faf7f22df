#include "server/rooms/rooms.hpp"

#include <algorithm>
#include <chrono>
#include <deque>
#include <future>
#include <iterator>
#include <system_error>
#include <utility>

#include "common/core/check.hpp"
#include "common/runtime/files.hpp"
#include "common/runtime/log.hpp"
#include "common/wire/version.hpp"
#include "server/auth/authorizer.hpp"
#include "server/storage/journal_entries.hpp"
#include "server/storage/room_files.hpp"
#include "server/storage/room_owners.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

constexpr const char* kEnding = ".journal";
constexpr const char* kBackupEnding = ".backup";
constexpr const char* kOpenList = "open-rooms";  // in the folder: the names of open rooms, one on each line
constexpr std::chrono::seconds kMaintainEvery{5};
// Entries that a playback reads ahead.
constexpr std::uint64_t kEntriesAhead = 256;

bool is_name(const std::string& name) {
  const auto fits = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
  };
  return !name.empty() && name.size() <= 64 && std::ranges::all_of(name, fits) && name.front() != '-';
}

// A plain name, which cannot lead to another folder.
bool is_backup_name(const std::string& name) {
  const fs::path plain = name;
  return plain == plain.filename() && plain.extension() == kBackupEnding && is_name(plain.stem().string());
}

// The first few names, for a sentence.
std::string some_of(const std::set<std::string>& names) {
  constexpr std::size_t kMost = 5;
  std::string text;
  for (auto name = names.begin(); name != names.end(); ++name) {
    if (std::distance(names.begin(), name) == kMost) return text + " and others";
    text += (text.empty() ? "" : ", ") + *name;
  }
  return text;
}

Error no_such_room(const std::string& name) {
  return {ErrorCode::not_found, "there is no room " + name + "; osteon-server rooms list shows which there are"};
}
Error not_open(const std::string& name) {
  return {ErrorCode::unavailable, "the room " + name + " is closed; osteon-server rooms resume " + name + " opens it"};
}
Error stored_elsewhere(const OpenRoom& room) {
  return {ErrorCode::unavailable,
          "the room " + room.name + " has its journal in " + room.store_file().string() +
              ", not in a folder of rooms; stop the server and see osteon-server --help for the commands for "
              "journals, or start it with --rooms FOLDER"};
}
Error not_persisted(const std::string& name) {
  return {ErrorCode::unavailable, "the room " + name + " has no journal; start osteon-server with --rooms FOLDER"};
}

std::uint64_t new_server_epoch() {
  // Without a journal that counts openings, the calendar rises from one opening to the next.
  const auto since_1970 = std::chrono::system_clock::now().time_since_epoch();
  return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::microseconds>(since_1970).count());
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    if (end > at) lines.push_back(text.substr(at, end - at));
    at = end + 1;
  }
  return lines;
}

// Reads ahead in a room's journal. The room stays in memory while it is shown.
class EntryReader {
 public:
  EntryReader(std::shared_ptr<OpenRoom> room, RoomSeq from, RoomSeq to)
      : room_(std::move(room)), next_(from), to_(to) {}
  std::optional<LogEntry> operator()() {
    if (ahead_.empty() && next_ <= to_) {
      const RoomSeq last{std::min(to_.value, next_.value + kEntriesAhead - 1)};
      const Result<void> read = room_->store()->read(next_, last, [&](const LogEntry& entry) {
        ahead_.push_back(entry);
        return true;
      });
      if (!read)
        log::error("a room's entries cannot be shown", {{"room", room_->name}, {"reason", read.error().message}});
      next_ = read ? RoomSeq{last.value + 1} : RoomSeq{to_.value + 1};
    }
    if (ahead_.empty()) return std::nullopt;
    LogEntry entry = std::move(ahead_.front());
    ahead_.pop_front();
    return entry;
  }

 private:
  std::shared_ptr<OpenRoom> room_;
  RoomSeq next_;
  const RoomSeq to_;
  std::deque<LogEntry> ahead_;
};

}  // namespace

OpenRoom::OpenRoom(std::string n, LoadedCase loaded, Room room, const RoomsOptions& options,
                   const std::function<void(double)>& progress, std::unique_ptr<RoomStore> store,
                   std::optional<Playback> playback)
    : name(std::move(n)),
      of(std::move(loaded)),
      server_epoch(store ? store->server_epoch() : new_server_epoch()),
      store_(std::move(store)) {
  // A room that was slow to open gets a checkpoint, so that the next opening is fast.
  constexpr std::uint64_t kLongReplay = 5000;
  if (store_ && store_->evaluated() > kLongReplay)
    if (const Result<void> kept = store_->checkpoint(room.room_seq(), room.all_leaves()); !kept)
      log::warn("no checkpoint", {{"room", name}, {"reason", kept.error().message}});
  runtime_ = std::make_unique<RoomRuntime>(std::move(room), options.rates, progress, options.detail, store_.get(),
                                           std::move(playback));
}

void OpenRoom::note_version(AuthorId author, std::uint32_t version) {
  const MutexLock lock(versions_mutex_);
  if (version == wire::kProtocolVersion)
    older_versions_.erase(author);
  else
    older_versions_[author] = version;
}

std::uint32_t OpenRoom::version_of(AuthorId author) const {
  const MutexLock lock(versions_mutex_);
  const auto older = older_versions_.find(author);
  return older == older_versions_.end() ? wire::kProtocolVersion : older->second;
}

void OpenRoom::end_streams(const std::string& why) {
  runtime_->find_pieces();
  runtime_->end_streams(why);
}

void OpenRoom::send_away(const std::string& why) {
  runtime_->find_pieces();
  runtime_->send_away(why);
}

RoomSummary OpenRoom::close() {
  demonstrations_.end_all();
  runtime_->stop();
  if (store_) {
    // Nothing is lost if this fails; only the next opening takes longer.
    if (const Result<void> kept = store_->checkpoint(runtime_->room_seq(), runtime_->all_leaves()); !kept)
      log::warn("no checkpoint", {{"room", name}, {"reason", kept.error().message}});
    if (const Result<void> closed = store_->close(); !closed)
      log::warn("the journal was not closed cleanly", {{"room", name}, {"reason", closed.error().message}});
  }
  return {runtime_->bone().hash(),
          runtime_->bone_status(),
          runtime_->health(),
          save,
          save.empty() ? SavedFields{} : runtime_->saved_fields(),
          runtime_->surface_hash()};
}

void OpenRoom::maintain(const std::function<bool()>& stop) {
  if (!store_ || store_->closed_to_entries()) return;
  if (Clock::now() - forgotten_ > std::chrono::hours(24)) {
    forgotten_ = Clock::now();
    if (const Result<std::size_t> gone = store_->erase_old_people(); !gone)
      log::warn("people were not erased", {{"room", name}, {"reason", gone.error().message}});
  }
  if (const Result<void> tidied = store_->tidy_if_idle(); !tidied)
    log::warn("the journal's log stays long", {{"room", name}, {"reason", tidied.error().message}});
  const bool due = CheckpointPolicy{}.is_due(store_->changes_since_checkpoint(), Clock::now() - newest_checkpoint_);
  if (!due) return;
  newest_checkpoint_ = Clock::now();
  // Written on this thread. The thread that copies the leaves also answers joins, and must not wait for the disk.
  std::promise<RoomRuntime::Leaves> copied;
  runtime_->run_slowly([&] { copied.set_value(runtime_->leaves_now()); });
  const RoomRuntime::Leaves now = copied.get_future().get();
  if (const Result<void> kept = store_->checkpoint(now.seq, now.leaves, {.progress = {}, .stop = stop}); !kept)
    log::warn("no checkpoint", {{"room", name}, {"reason", kept.error().message}});
}

Rooms::Rooms(RoomsOptions options) : options_(std::move(options)), cases_(options_.case_memory_bytes) {
  OSTEON_CHECK(!options_.cases.empty());
  for (const ServedCase& served : options_.cases) cases_.keep(served);
  for (JobThread* calls : {&jobs, &files, &plans, &recordings, &checks}) calls->start();
  maintenance_ = std::thread([this] { run_maintenance(); });
}

Rooms::~Rooms() {
  begin_end();
  end_calls();
  (void)close_all();
}

void Rooms::end_calls() {
  for (JobThread* calls : {&jobs, &files, &plans, &recordings, &checks}) calls->stop();
}

void Rooms::run_maintenance() {
  using Clock = std::chrono::steady_clock;
  Clock::time_point forget_at = Clock::now();
  const auto maintain = [&] {
    if (options_.retention_days > 0 && Clock::now() >= forget_at) {
      forget_at += std::chrono::hours(24);
      if (const std::size_t gone = forget_owners(options_.folder, std::chrono::days(options_.retention_days)); gone > 0)
        log::info("owners erased", {{"count", gone}});
    }
    for (const std::shared_ptr<OpenRoom>& room : open_rooms()) room->maintain(until_the_end().stop);
  };
  MutexLock lock(mutex_);
  do {
    lock.unlock();
    maintain();
    lock.lock();
  } while (!maintenance_wake_.wait_for(lock, kMaintainEvery, [&] { return ending_.load(); }));
}

MaintenanceCalls Rooms::until_the_end() const {
  return {.progress = {}, .stop = [this] { return ending_.load(); }};
}

void Rooms::begin_drain(std::chrono::milliseconds again, const std::string& why) {
  {
    const MutexLock lock(mutex_);
    draining_ = why;
  }
  const std::vector<std::shared_ptr<OpenRoom>> rooms = open_rooms();
  for (const std::shared_ptr<OpenRoom>& room : rooms) room->runtime().ask_to_redial(again, why);
  // A demonstration is a session that cannot be asked to leave.
  for (const std::shared_ptr<OpenRoom>& room : rooms) room->demonstrations().end_all();
}

std::optional<std::string> Rooms::draining() const {
  const MutexLock lock(mutex_);
  return draining_;
}

void Rooms::begin_end() {
  {
    const MutexLock lock(mutex_);
    ending_ = true;
    maintenance_wake_.notify_all();
  }
  if (maintenance_.joinable()) maintenance_.join();
}

Result<std::shared_ptr<OpenRoom>> Rooms::find(const std::string& name) const {
  const MutexLock lock(mutex_);
  if (const auto found = open_.find(name); found != open_.end()) return found->second;
  if (!name.empty()) return stored_file(name) ? tl::unexpected(not_open(name)) : tl::unexpected(no_such_room(name));
  if (open_.size() == 1) return open_.begin()->second;
  if (open_.empty())
    return failure(ErrorCode::unavailable, "no room is open here; osteon-server rooms create NAME makes one");
  std::string names;
  for (const auto& [one, room] : open_) names += (names.empty() ? "" : ", ") + one;
  return failure(ErrorCode::unavailable, "several rooms are open here: " + names + "; name one with --room");
}

std::vector<std::shared_ptr<OpenRoom>> Rooms::open_rooms() const {
  const MutexLock lock(mutex_);
  std::vector<std::shared_ptr<OpenRoom>> rooms;
  for (const auto& [name, room] : open_) rooms.push_back(room);
  return rooms;
}

fs::path Rooms::journal_of(const std::string& name) const { return options_.folder / (name + kEnding); }

Result<fs::path> Rooms::stored_file(const std::string& name) const {
  std::error_code ignored;
  if (is_name(name) && !options_.folder.empty() && fs::exists(journal_of(name), ignored)) return journal_of(name);
  return tl::unexpected(no_such_room(name));
}

std::size_t Rooms::count() const {
  std::set<std::string> names;
  for (const std::shared_ptr<OpenRoom>& room : open_rooms()) names.insert(room->name);
  std::error_code ignored;
  if (!options_.folder.empty())
    for (const auto& entry : fs::directory_iterator(options_.folder, ignored))
      if (entry.path().extension() == kEnding && is_name(entry.path().stem().string()))
        names.insert(entry.path().stem().string());
  return names.size();
}

std::vector<RoomListing> Rooms::list() const {
  std::map<std::string, RoomListing> all;
  const auto set_origin = [&](RoomListing& listing, const RoomGenesis& genesis) {
    listing.case_hash = genesis.case_hash;
    listing.parent = genesis.parent;
    listing.parent_room_seq = genesis.parent_room_seq;
    if (const std::optional<KnownCase> known = find_case(genesis.case_hash)) listing.case_title = known->title;
  };
  for (const std::shared_ptr<OpenRoom>& room : open_rooms()) {
    RoomListing& listing = all[room->name];
    const RuntimeHealth health = room->runtime().health();
    if (room->store()) set_origin(listing, room->store()->genesis());
    listing.name = room->name;
    listing.open = health.serving;
    listing.kept = room->store() != nullptr;
    listing.case_hash = room->runtime().bone().hash();
    listing.case_title = room->runtime().bone().info().title;
    listing.room_seq = health.room_seq;
    listing.sessions = health.sessions;
    listing.watchers = health.mesh_streams + health.cutting_streams;
    if (room->shows) {
      listing.replay = true;
      listing.parent = room->shows->first;
      listing.parent_room_seq = room->shows->second;
    }
  }
  std::error_code ignored;
  if (!options_.folder.empty())
    for (const auto& entry : fs::directory_iterator(options_.folder, ignored)) {
      const std::string name = entry.path().stem().string();
      if (entry.path().extension() != kEnding || !is_name(name) || all.contains(name)) continue;
      RoomListing& listing = all[name];
      listing.name = name;
      listing.kept = true;
      if (const Result<RoomGenesis> genesis = peek_genesis(entry.path())) set_origin(listing, *genesis);
    }
  std::vector<RoomListing> listed;
  for (auto& [name, listing] : all) listed.push_back(std::move(listing));
  return listed;
}

std::string Rooms::owner(const std::string& name) const {
  if (const Result<std::shared_ptr<OpenRoom>> room = find(name); room && !(*room)->store()) return (*room)->owner;
  if (options_.folder.empty() || !(is_name(name) || is_backup_name(name))) return {};
  return owner_of(is_name(name) ? journal_of(name) : options_.folder / name);
}

// Limits the share of one person, so that nobody uses up the rooms of all.
Result<void> Rooms::check_share(const Requester& by) const {
  if (by.user.empty() || by.may_have_any_number) return {};
  std::set<std::string> own = owned_by(by.user, options_.folder, kEnding);
  for (const std::shared_ptr<OpenRoom>& room : open_rooms())
    if (room->owner == by.user) own.insert(room->name);
  if (own.size() < static_cast<std::size_t>(options_.most_rooms_per_person)) return {};
  return failure(
      ErrorCode::exhausted,
      "you have made " + std::to_string(own.size()) + " rooms (" + some_of(own) +
          "), as many as one person may have; delete one with osteon-server rooms delete NAME, or ask whoever "
          "runs the server for a larger --most-rooms-per-person");
}

Result<void> Rooms::check_new(const std::string& name, const Requester& by) const {
  if (!is_name(name))
    return failure(ErrorCode::invalid_input,
                   "\"" + name + "\" is no name of a room; use letters, digits, - and _, at most 64");
  if (Result<void> free = check_free(name); !free) return free;
  // An open room holds a bone and threads; a closed one holds a journal.
  if (count() < static_cast<std::size_t>(options_.most_rooms)) return check_share(by);
  return failure(ErrorCode::exhausted, "there are " + std::to_string(options_.most_rooms) +
                                           " rooms, open and closed, as many as there may be; delete some, or start "
                                           "the server with a larger --most-rooms");
}

Result<void> Rooms::check_free(const std::string& name) const {
  const MutexLock lock(mutex_);
  if (open_.contains(name) || stored_file(name))
    return failure(ErrorCode::exists, "there is a room " + name + "; choose another name");
  return {};
}

std::shared_ptr<OpenRoom> Rooms::take_in(std::shared_ptr<OpenRoom> room) {
  {
    const MutexLock lock(mutex_);
    open_[room->name] = room;
    to_open_.erase(room->name);
  }
  note_open();
  log::info("room open", {{"room", room->name},
                          {"room_seq", room->runtime().room_seq().value},
                          {"persisted", room->store() != nullptr},
                          {"serving", !room->runtime().stopped()}});
  return room;
}

std::shared_ptr<OpenRoom> Rooms::take_out(const std::string& name) {
  const MutexLock lock(mutex_);
  const auto found = open_.find(name);
  if (found == open_.end()) return nullptr;
  std::shared_ptr<OpenRoom> room = std::move(found->second);
  open_.erase(found);
  return room;
}

void Rooms::note_open() const {
  if (options_.folder.empty()) return;
  std::set<std::string> all;
  {
    const MutexLock lock(mutex_);
    all = to_open_;
  }
  for (const std::shared_ptr<OpenRoom>& room : open_rooms())
    if (room->store()) all.insert(room->name);
  std::string names;
  for (const std::string& name : all) names += name + "\n";
  if (const Result<void> written = write_file(options_.folder / kOpenList, names); !written)
    log::warn("which rooms are open was not noted", {{"reason", written.error().message}});
}

Result<std::shared_ptr<OpenRoom>> Rooms::add(const std::string& name, Room room, std::unique_ptr<RoomStore> store,
                                             fs::path save, const std::function<void(double)>& progress) {
  const MutexLock changing(changing_);
  if (Result<void> may = check_free(name); !may) return tl::unexpected(may.error());
  const Result<LoadedCase> of = cases_.load(room.bone().hash());
  if (!of) return tl::unexpected(of.error());
  auto made = std::make_shared<OpenRoom>(name, *of, std::move(room), options_, progress, std::move(store));
  made->save = std::move(save);
  return take_in(std::move(made));
}

void Rooms::resume_all(const std::function<void(double)>& progress) {
  const Result<std::string> noted = read_file(options_.folder / kOpenList);
  if (!noted) return;
  const std::vector<std::string> names = lines_of(*noted);
  {
    const MutexLock lock(mutex_);
    to_open_ = {names.begin(), names.end()};
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto part = [&](double fraction) {
      progress((static_cast<double>(i) + fraction) / static_cast<double>(names.size()));
    };
    const Result<std::shared_ptr<OpenRoom>> room = resume(names[i], part);
    if (!room) log::error("a room cannot be opened", {{"room", names[i]}, {"reason", room.error().message}});
  }
}

Result<std::shared_ptr<OpenRoom>> Rooms::create(const std::string& name, const Digest* case_hash, const Requester& by) {
  const MutexLock changing(changing_);
  if (Result<void> may = check_new(name, by); !may) return tl::unexpected(may.error());
  if (!case_hash && cases().size() > 1)
    return failure(ErrorCode::invalid_input, "the server has several cases; say which with --case-hash");
  const Result<LoadedCase> of = cases_.load(case_hash ? *case_hash : cases().front().hash);
  if (!of) return tl::unexpected(of.error());
  if (!options_.folder.empty())
    return make_owned(journal_of(name), by.user, [&] {
      changing_.assert_held();
      return open(name, *of, true, {});
    });
  auto made = std::make_shared<OpenRoom>(name, *of, Room(*of->bone, options_.limits, options_.tools()), options_,
                                         std::function<void(double)>{}, nullptr);
  made->owner = by.user;
  return take_in(std::move(made));
}

Result<std::shared_ptr<OpenRoom>> Rooms::resume(const std::string& name, const std::function<void(double)>& progress) {
  const MutexLock changing(changing_);
  if (Result<std::shared_ptr<OpenRoom>> already = find(name); already && !name.empty()) {
    const RoomStore* store = (*already)->store();
    if (const Error* why = store ? store->closed_to_entries() : nullptr)
      return failure(ErrorCode::unavailable, "the room " + name + " is there and takes no more cuts: " + why->message);
    return already;
  }
  const Result<fs::path> file = stored_file(name);
  if (!file) return tl::unexpected(file.error());
  const Result<RoomGenesis> genesis = peek_genesis(*file);
  if (!genesis) return tl::unexpected(genesis.error());
  if (!find_case(genesis->case_hash))
    return failure(ErrorCode::unsupported, "the room " + name + " is of the case " + to_hex(genesis->case_hash) +
                                               ", which the server was not given with --case");
  const Result<LoadedCase> of = cases_.load(genesis->case_hash);
  if (!of) return tl::unexpected(of.error());
  return open(name, *of, false, progress);
}

Result<std::shared_ptr<OpenRoom>> Rooms::open(const std::string& name, const LoadedCase& of, bool is_new,
                                              const std::function<void(double)>& progress) {
  RoomStore::Options keeping{
      .name = name, .limits = options_.limits, .tools = {}, .journal = {}, .today = {}, .random = {}};
  keeping.journal.keys = options_.keys;
  keeping.retention_days = options_.retention_days;
  if (is_new) keeping.tools = options_.tools();
  // The events are about half of the work, the surface is the other half.
  const auto half = [&](double begin) {
    return [&progress, begin](double fraction) {
      if (progress) progress(begin + fraction / 2);
    };
  };
  Result<PersistedRoom> kept = RoomStore::open(journal_of(name), *of.bone, keeping, half(0));
  if (!kept) return tl::unexpected(kept.error());
  return take_in(
      std::make_shared<OpenRoom>(name, of, std::move(kept->room), options_, half(0.5), std::move(kept->store)));
}

Result<RoomSummary> Rooms::close(const std::string& name) {
  const MutexLock changing(changing_);
  if (const auto kept = find(name); kept && (*kept)->store() && !stored_file((*kept)->name))
    return tl::unexpected(stored_elsewhere(**kept));
  const std::shared_ptr<OpenRoom> room = take_out(name);
  if (!room) return stored_file(name) ? tl::unexpected(not_open(name)) : tl::unexpected(no_such_room(name));
  room->end_streams("the room " + name + " was closed");
  RoomSummary summary = room->close();
  note_open();
  if (!summary.save.empty())
    if (Result<void> saved = save_fields(summary.save, summary.fields); !saved) return tl::unexpected(saved.error());
  log::info("room closed", {{"room", name}, {"room_seq", summary.bone.room_seq.value}});
  return summary;
}

Result<std::shared_ptr<OpenRoom>> Rooms::branch(const std::string& name, const std::string& new_name, RoomSeq to,
                                                const Requester& by) {
  {
    const MutexLock changing(changing_);
    if (Result<void> may = check_new(new_name, by); !may) return tl::unexpected(may.error());
    const Result<std::shared_ptr<OpenRoom>> from = find(name);
    if (from && !(*from)->store()) return tl::unexpected(not_persisted(name));
    if (from && options_.folder.empty()) return tl::unexpected(stored_elsewhere(**from));
    const Result<fs::path> file = from ? Result<fs::path>(fs::path{}) : stored_file(name);
    if (!file) return tl::unexpected(file.error());
    const fs::path journal = journal_of(new_name);
    const Result<JournalHead> made = make_owned(journal, by.user, [&] {
      return from ? (*from)->store()->branch(journal, to, new_name, until_the_end())
                  : branch_journal(*file, journal, to, new_name, until_the_end());
    });
    if (!made) return tl::unexpected(made.error());
  }
  return resume(new_name);
}

Result<std::shared_ptr<OpenRoom>> Rooms::replay(const std::string& name, const std::string& new_name, RoomSeq from,
                                                RoomSeq to, double speed, const Requester& by) {
  const MutexLock changing(changing_);
  if (Result<void> may = check_new(new_name, by); !may) return tl::unexpected(may.error());
  if (!(speed >= 0 && speed <= 1e6)) return failure(ErrorCode::invalid_input, "the speed is not between 0 and 1000000");
  const Result<std::shared_ptr<OpenRoom>> source = find(name);
  if (!source) return tl::unexpected(source.error());
  RoomStore* store = (*source)->store();
  if (!store) return tl::unexpected(not_persisted(name));
  const RoomSeq head = store->head().seq;
  const RoomSeq last = to ? to : head;
  if (last > head || from > last)
    return failure(ErrorCode::invalid_input, "events " + std::to_string(from.value) + " to " +
                                                 std::to_string(last.value) + " are not among the " +
                                                 std::to_string(head.value) + " of room " + name);
  const LoadedCase& of = (*source)->of;
  Result<Room> room = begin_room(*of.bone, store->genesis(), options_.limits);
  if (!room) return tl::unexpected(room.error());
  Result<void> happened;
  const Result<void> read = !from ? Result<void>{} : store->read(RoomSeq{1}, from, [&](const LogEntry& entry) {
    happened = room->replay(entry);
    return happened.has_value();
  });
  if (!happened) return tl::unexpected(happened.error());
  if (!read) return tl::unexpected(read.error());
  (void)room->take_changes();
  Playback playback{EntryReader(*source, RoomSeq{from.value + 1}, last), speed};
  auto shown = std::make_shared<OpenRoom>(new_name, of, std::move(*room), options_, std::function<void(double)>{},
                                          nullptr, std::move(playback));
  shown->shows = {name, last};
  shown->owner = by.user;
  return take_in(std::move(shown));
}

Result<RoomGenesis> Rooms::read(const std::string& name, RoomSeq to, const std::function<bool(const LogEntry&)>& take) {
  if (const Result<std::shared_ptr<OpenRoom>> room = find(name)) {
    RoomStore* store = (*room)->store();
    if (!store) return tl::unexpected(not_persisted(name));
    const RoomSeq head = store->head().seq;
    if (const Result<void> read = store->read(RoomSeq{1}, to ? std::min(to, head) : head, take); !read)
      return tl::unexpected(read.error());
    return store->genesis();
  }
  // Nobody can open it meanwhile.
  const MutexLock changing(changing_);
  const Result<fs::path> file = stored_file(name);
  if (!file) return tl::unexpected(file.error());
  Result<Journal> journal = Journal::open_to_read(*file);
  if (!journal) return tl::unexpected(journal.error());
  Result<RoomGenesis> genesis = genesis_from_bytes(journal->genesis());
  Result<void> sound;
  const Result<void> read = journal->read(RoomSeq{1}, [&](const JournalEntry& entry) {
    if (to && entry.seq > to) return false;
    const Result<LogEntry> one = entry_from_bytes(entry.seq, std::chrono::nanoseconds(entry.at_ns), entry.bytes);
    if (!one) sound = tl::unexpected(one.error());
    return one && take(*one);
  });
  if (!sound) return tl::unexpected(sound.error());
  if (!read) return tl::unexpected(read.error());
  return genesis;
}

Result<Shown> Rooms::demonstrate(OpenRoom& in, AuthorId by, const Caller& caller, const WhatToShow& what) {
  if (const std::optional<std::string> why = draining()) return failure(ErrorCode::unavailable, *why);
  const auto read_until_the_end = [this](const std::string& room, RoomSeq to,
                                         const std::function<bool(const LogEntry&)>& take) -> Result<RoomGenesis> {
    Result<RoomGenesis> genesis = read(room, to, [&](const LogEntry& entry) { return !ending() && take(entry); });
    if (ending()) return failure(ErrorCode::unavailable, "the room is closed");
    return genesis;
  };
  return in.demonstrations().begin({in.name, in.runtime(), read_until_the_end, authorizer}, by, caller, what);
}

Result<std::vector<std::string>> Rooms::remove(const std::string& name, bool with_branches,
                                               const std::function<Result<void>(const std::string& room)>& may) {
  if (is_backup_name(name)) return remove_backup(name, may);
  std::vector<std::string> names{name};
  if (const Result<fs::path> file = stored_file(name)) {
    // Only a room's own store can read a journal that is in use.
    const auto has = [this](const fs::path& of, const JournalHead& head) {
      const Result<std::shared_ptr<OpenRoom>> in_use = find(of.stem().string());
      return in_use && of == journal_of((*in_use)->name) ? (*in_use)->store()->has_head(head) : has_head(of, head);
    };
    const Result<std::vector<RoomFile>> branches = branches_of(options_.folder, *file, has);
    if (!branches) return tl::unexpected(branches.error());
    // A backup in the folder is not a room.
    for (const RoomFile& branch : *branches)
      if (branch.file == journal_of(branch.file.stem().string())) names.push_back(branch.file.stem().string());
    if (names.size() > 1 && !with_branches) {
      std::string list;
      for (std::size_t i = 1; i < names.size(); ++i) list += (i > 1 ? ", " : "") + names[i];
      return failure(ErrorCode::unavailable, "the room " + name + " has branches, which hold what it was: " + list +
                                                 "; say --with-branches to delete them too");
    }
  } else if (const Result<std::shared_ptr<OpenRoom>> room = find(name); !room || name.empty()) {
    return tl::unexpected(file.error());
  } else if ((*room)->store()) {
    return tl::unexpected(stored_elsewhere(**room));
  }
  for (const std::string& one : names)
    if (const Result<void> allowed = may ? may(one) : Result<void>{}; !allowed) return tl::unexpected(allowed.error());
  std::vector<std::string> deleted;
  // Branches first: after an interruption, the rest is still known as branches.
  for (auto one = names.rbegin(); one != names.rend(); ++one) {
    if (find(*one))
      if (const Result<RoomSummary> closed = close(*one); !closed) return tl::unexpected(closed.error());
    const MutexLock changing(changing_);
    if (const Result<fs::path> file = stored_file(*one))
      if (const auto gone = delete_room(*file, false); !gone) return tl::unexpected(gone.error());
    deleted.push_back(*one);
    log::info("room deleted", {{"room", *one}});
  }
  return deleted;
}

Result<std::vector<std::string>> Rooms::remove_backup(const std::string& name,
                                                      const std::function<Result<void>(const std::string&)>& may) {
  const fs::path file = options_.folder / name;
  std::error_code ignored;
  if (options_.folder.empty() || !fs::exists(file, ignored))
    return failure(ErrorCode::not_found, "there is no backup " + name + " in the server's folder of rooms");
  if (const Result<void> allowed = may ? may(name) : Result<void>{}; !allowed) return tl::unexpected(allowed.error());
  if (const Result<void> gone = delete_journals({file}); !gone) return tl::unexpected(gone.error());
  log::info("backup deleted", {{"file", name}});
  return std::vector<std::string>{name};
}

Result<RoomReport> Rooms::verify(const std::string& name) {
  const Result<std::shared_ptr<OpenRoom>> room = find(name);
  if (!room) return tl::unexpected(room.error());
  if (!(*room)->store()) return tl::unexpected(not_persisted(name));
  std::promise<BoneStatus> bone;
  (*room)->runtime().run_slowly([&] { bone.set_value((*room)->runtime().bone_status()); });
  const BoneStatus status = bone.get_future().get();
  // What is decided is durable a moment later.
  while ((*room)->store()->head().seq < status.room_seq && !(*room)->runtime().stopped() && !ending_)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  if ((*room)->store()->head().seq < status.room_seq)
    return failure(
        ErrorCode::unavailable,
        "the room " + name + " has stopped; check its journal with osteon-server verify once the server has ended");
  return (*room)->store()->verify((*room)->runtime().bone(), BoneAt{status.room_seq, status.field_hash},
                                  until_the_end());
}

Result<JournalHead> Rooms::back_up(const std::string& name, const std::string& file_name, fs::path& file,
                                   const Requester& by) {
  const Result<std::shared_ptr<OpenRoom>> room = find(name);
  if (!room) return tl::unexpected(room.error());
  if (!(*room)->store()) return tl::unexpected(not_persisted(name));
  if (options_.folder.empty()) return tl::unexpected(stored_elsewhere(**room));
  // A client may not name a folder, as it could then write anywhere on the server's disk.
  if (!is_backup_name(file_name))
    return failure(ErrorCode::invalid_input, "\"" + file_name + "\" is not a plain name that ends in .backup");
  file = options_.folder / file_name;
  std::error_code ignored;
  if (fs::exists(file, ignored))
    return failure(ErrorCode::exists, "there is a backup " + file_name + "; choose another name, or delete it");
  const std::set<std::string> own =
      by.user.empty() ? std::set<std::string>{} : owned_by(by.user, options_.folder, kBackupEnding);
  if (own.size() >= static_cast<std::size_t>(options_.most_backups_per_person))
    return failure(ErrorCode::exhausted,
                   "you have made " + std::to_string(own.size()) + " backups (" + some_of(own) +
                       "), as many as one person may have on the server; delete one with osteon-server rooms delete "
                       "NAME.backup, move some elsewhere, or start the server with a larger --most-backups-per-person");
  return make_owned(file, by.user, [&] { return (*room)->store()->backup(file, until_the_end()); });
}

std::map<std::string, RoomSummary> Rooms::close_all() {
  const MutexLock changing(changing_);
  std::map<std::string, RoomSummary> summaries;
  for (const std::shared_ptr<OpenRoom>& room : open_rooms()) {
    (void)take_out(room->name);
    const auto closed = summaries.emplace(room->name, room->close()).first;
    log::info("room closed", {{"room", room->name}, {"room_seq", closed->second.bone.room_seq.value}});
  }
  return summaries;
}

}  // namespace osteon
