#include "tests/support/disk/memory_disk.hpp"

#include <sqlite3.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <new>
#include <set>
#include <system_error>

#include "common/core/check.hpp"

namespace osteon::test {
namespace {

namespace fs = std::filesystem;

std::string name_of(const fs::path& file) { return file.lexically_normal().string(); }

tl::unexpected<Error> cannot(const char* what, const fs::path& file, int reason) {
  return failure(reason == ENOENT ? ErrorCode::not_found : ErrorCode::internal,
                 "cannot " + std::string(what) + " " + file.string() + ": " + std::generic_category().message(reason) +
                     std::string(remedy_of(reason)));
}

Result<void> done_or(int reason, const char* what, const fs::path& file) {
  if (reason != 0) return cannot(what, file, reason);
  return {};
}

}  // namespace

struct MemoryDisk::Content {
  std::string seen;               // what a read returns
  std::string kept;               // what is on the disk
  std::set<std::size_t> waiting;  // sectors written since the last sync
  int exclusive = 0, shared = 0;  // locks held since `boot`
  std::uint64_t boot = 0;

  void mark(std::size_t sector_bytes, std::uint64_t from, std::uint64_t to) {
    if (from >= to) return;
    for (std::size_t sector = from / sector_bytes; sector * sector_bytes < to; ++sector) waiting.insert(sector);
  }
  // The bytes of a sector; zeros behind the end of `of`.
  static std::string sector(const std::string& of, std::size_t sector_bytes, std::size_t at) {
    std::string bytes = at * sector_bytes < of.size() ? of.substr(at * sector_bytes, sector_bytes) : std::string();
    bytes.resize(sector_bytes, '\0');
    return bytes;
  }
  // Writes a sector at its position, as far as `into` reaches.
  static void place(std::string& into, std::size_t sector_bytes, std::size_t at, const std::string& bytes) {
    const std::size_t from = at * sector_bytes;
    if (from < into.size())
      into.replace(from, std::min(sector_bytes, into.size() - from), bytes, 0, into.size() - from);
  }
  // The sector reaches the disk.
  void keep(std::size_t sector_bytes, std::size_t at) {
    const std::size_t end = std::min(seen.size(), (at + 1) * sector_bytes);
    if (kept.size() < end) kept.resize(end, '\0');
    place(kept, sector_bytes, at, sector(seen, sector_bytes, at));
  }
};

// ---------------------------------------------------------------------------------------------- under SQLite

struct MemoryDisk::Sqlite {
  sqlite3_vfs table{};
  std::string name;

  struct File {
    sqlite3_file base;
    MemoryDisk* disk;
    Contents content;
    std::string folder;
    bool new_log;    // its name is synced with its first bytes, as SQLite does on a real disk
    bool powersafe;  // SQLite assumes that a torn write spoils nothing beside it, which is wrong here
  };

  static MemoryDisk& disk_of(sqlite3_vfs* vfs) { return *static_cast<MemoryDisk*>(vfs->pAppData); }
  static File& file_of(sqlite3_file* file) { return *reinterpret_cast<File*>(file); }
  static int told(MemoryDisk& disk, int reason, int code) {
    if (reason == 0) return SQLITE_OK;
    disk.last_error_ = reason;
    return reason == ENOSPC ? SQLITE_FULL : code;
  }

  static int close(sqlite3_file* file) {
    --file_of(file).disk->open_files_;
    file_of(file).content.~Contents();
    file_of(file).folder.~basic_string();
    return SQLITE_OK;
  }
  static int read(sqlite3_file* file, void* to, int count, sqlite3_int64 from) {
    File& f = file_of(file);
    if (f.disk->off_) return told(*f.disk, EIO, SQLITE_IOERR_READ);
    const std::string& bytes = f.content->seen;
    const auto at = static_cast<std::size_t>(from), wanted = static_cast<std::size_t>(count);
    const std::size_t have = at < bytes.size() ? std::min(wanted, bytes.size() - at) : 0;
    if (have != 0) std::memcpy(to, bytes.data() + at, have);
    std::memset(static_cast<char*>(to) + have, 0, wanted - have);
    return have == wanted ? SQLITE_OK : SQLITE_IOERR_SHORT_READ;
  }
  static int write(sqlite3_file* file, const void* bytes, int count, sqlite3_int64 to) {
    File& f = file_of(file);
    const std::string_view piece(static_cast<const char*>(bytes), static_cast<std::size_t>(count));
    return told(*f.disk, f.disk->write_at(*f.content, static_cast<std::uint64_t>(to), piece), SQLITE_IOERR_WRITE);
  }
  static int truncate(sqlite3_file* file, sqlite3_int64 size) {
    File& f = file_of(file);
    return told(*f.disk, f.disk->truncate(*f.content, static_cast<std::uint64_t>(size)), SQLITE_IOERR_TRUNCATE);
  }
  static int sync(sqlite3_file* file, int) {
    File& f = file_of(file);
    if (const int reason = f.disk->sync(*f.content)) return told(*f.disk, reason, SQLITE_IOERR_FSYNC);
    if (!std::exchange(f.new_log, false)) return SQLITE_OK;
    return told(*f.disk, f.disk->sync_names(f.folder), SQLITE_IOERR_DIR_FSYNC);
  }
  static int size(sqlite3_file* file, sqlite3_int64* bytes) {
    *bytes = static_cast<sqlite3_int64>(file_of(file).content->seen.size());
    return SQLITE_OK;
  }
  static int lock(sqlite3_file*, int) { return SQLITE_OK; }
  static int is_reserved(sqlite3_file*, int* answer) {
    *answer = 0;
    return SQLITE_OK;
  }
  static int control(sqlite3_file*, int, void*) { return SQLITE_NOTFOUND; }
  static int sector_size(sqlite3_file* file) { return static_cast<int>(file_of(file).disk->sector_bytes_); }
  static int character(sqlite3_file* file) { return file_of(file).powersafe ? SQLITE_IOCAP_POWERSAFE_OVERWRITE : 0; }

  static int open(sqlite3_vfs* vfs, const char* name, sqlite3_file* file, int flags, int* flags_out) {
    static const sqlite3_io_methods kMethods{1,       close,   read,        write,   truncate,    sync,      size,
                                             lock,    lock,    is_reserved, control, sector_size, character, nullptr,
                                             nullptr, nullptr, nullptr,     nullptr, nullptr};
    MemoryDisk& disk = disk_of(vfs);
    file->pMethods = nullptr;
    OSTEON_CHECK(name != nullptr);  // a temporary file: the journal keeps those in memory
    if (disk.off_) return told(disk, EIO, SQLITE_CANTOPEN);
    const std::string path = name_of(name);
    Contents content = disk.find(path);
    if (!content) {
      if ((flags & SQLITE_OPEN_CREATE) == 0) return told(disk, ENOENT, SQLITE_CANTOPEN);
      content = std::make_shared<Content>();
      if (const int reason = disk.change_names({{path, content}})) return told(disk, reason, SQLITE_CANTOPEN);
    }
    const bool log = (flags & SQLITE_OPEN_CREATE) != 0 && (flags & (SQLITE_OPEN_WAL | SQLITE_OPEN_MAIN_JOURNAL)) != 0;
    // As in SQLite's own file system: the default is "powersafe".
    const bool powersafe = (flags & SQLITE_OPEN_MAIN_DB) != 0 && sqlite3_uri_boolean(name, "psow", 1) != 0;
    new (file) File{{&kMethods}, &disk, std::move(content), folder_of(path).string(), log, powersafe};
    ++disk.open_files_;
    if (flags_out != nullptr) *flags_out = flags;
    return SQLITE_OK;
  }
  static int remove(sqlite3_vfs* vfs, const char* name, int sync_folder) {
    MemoryDisk& disk = disk_of(vfs);
    const std::string path = name_of(name);
    if (disk.off_) return told(disk, EIO, SQLITE_IOERR_DELETE);
    if (!disk.find(path)) return SQLITE_IOERR_DELETE_NOENT;
    if (const int reason = disk.change_names({{path, nullptr}})) return told(disk, reason, SQLITE_IOERR_DELETE);
    return sync_folder == 0 ? SQLITE_OK : told(disk, disk.sync_names(folder_of(path).string()), SQLITE_IOERR_DIR_FSYNC);
  }
  static int access(sqlite3_vfs* vfs, const char* name, int, int* answer) {
    const Contents content = disk_of(vfs).find(name_of(name));
    *answer = content && !content->seen.empty() ? 1 : 0;  // SQLite's own also treats an empty file as none
    return SQLITE_OK;
  }
  static int full_name(sqlite3_vfs*, const char* name, int most, char* full) {
    sqlite3_snprintf(most, full, "%s", name);
    return SQLITE_OK;
  }
  static int randomness(sqlite3_vfs* vfs, int count, char* bytes) {
    for (int i = 0; i < count; ++i) bytes[i] = static_cast<char>(disk_of(vfs).random_());
    return count;
  }
  static int sleep(sqlite3_vfs*, int microseconds) { return microseconds; }
  static int now(sqlite3_vfs*, double* days) {
    *days = 2460000.5;
    return SQLITE_OK;
  }
  static int last_error(sqlite3_vfs* vfs, int, char*) { return disk_of(vfs).last_error_; }

  Sqlite(MemoryDisk& disk, std::string vfs_name) : name(std::move(vfs_name)) {
    table.iVersion = 1;
    table.szOsFile = sizeof(File);
    table.mxPathname = 512;
    table.zName = name.c_str();
    table.pAppData = &disk;
    table.xOpen = open;
    table.xDelete = remove;
    table.xAccess = access;
    table.xFullPathname = full_name;
    table.xRandomness = randomness;
    table.xSleep = sleep;
    table.xCurrentTime = now;
    table.xGetLastError = last_error;
    OSTEON_CHECK(sqlite3_vfs_register(&table, 0) == SQLITE_OK);
  }
  ~Sqlite() { sqlite3_vfs_unregister(&table); }
  Sqlite(const Sqlite&) = delete;
  Sqlite& operator=(const Sqlite&) = delete;
};

// ---------------------------------------------------------------------------------------------- the disk

MemoryDisk::MemoryDisk(std::uint64_t seed, std::size_t sector_bytes) : random_(seed), sector_bytes_(sector_bytes) {
  static std::uint64_t made = 0;
  sqlite_ = std::make_unique<Sqlite>(*this, "osteon-memory-" + std::to_string(++made));
  sqlite3_test_control(SQLITE_TESTCTRL_PRNG_SEED, static_cast<int>(1 + seed % 1000000007), nullptr);
}

MemoryDisk::~MemoryDisk() { OSTEON_CHECK(open_files_ == 0); }

std::string MemoryDisk::vfs() const { return sqlite_->name; }

int MemoryDisk::Fault::next() {
  if (at == 0) return 0;
  if (at > 1) {
    --at;
    return 0;
  }
  if (lasting == Lasting::once) at = 0;
  return error;
}

int MemoryDisk::before(std::uint64_t& count, Fault& fault) {
  if (off_) return EIO;
  ++count;
  const int either = fault_.next(), own = fault.next();
  if (power_fault_.next() != 0) off_ = true;
  const int error = off_ ? EIO : either != 0 ? either : own;
  failed_ = failed_ || error != 0;
  return error;
}

int MemoryDisk::write_at(Content& content, std::uint64_t from, std::string_view bytes) {
  if (off_) return EIO;
  const int error = before_write();
  // A failed write may have written a part, also if the power cut it short.
  if (error != 0) bytes = bytes.substr(0, random_() % (bytes.size() + 1));
  const std::uint64_t end = from + bytes.size();
  counts_.written_bytes += bytes.size();
  // The system may write a sector at any time by itself. Then the sector is written again.
  for (const std::size_t sector : {from / sector_bytes_, end / sector_bytes_})
    if (content.waiting.contains(sector) && chance(8)) content.keep(sector_bytes_, sector);
  if (content.seen.size() < end) {
    content.mark(sector_bytes_, content.seen.size(), end);
    content.seen.resize(end, '\0');
  }
  content.mark(sector_bytes_, from, end);
  std::copy(bytes.begin(), bytes.end(), content.seen.begin() + static_cast<std::ptrdiff_t>(from));
  return error;
}

int MemoryDisk::truncate(Content& content, std::uint64_t size) {
  if (const int error = before_write(); error != 0) return error;
  // A file is shortened at once or, if that is lost, not at all.
  content.waiting.erase(content.waiting.lower_bound((size + sector_bytes_ - 1) / sector_bytes_), content.waiting.end());
  content.mark(sector_bytes_, content.seen.size(), size);
  content.seen.resize(size, '\0');
  return 0;
}

int MemoryDisk::sync(Content& content) {
  const int error = before_sync();
  if (off_) return error;
  if (error == 0) {
    content.kept.resize(content.seen.size(), '\0');
    for (const std::size_t sector : content.waiting) content.keep(sector_bytes_, sector);
  } else {
    for (const std::size_t sector : content.waiting) {
      const std::uint64_t fate = random_() % 3;
      if (fate == 0) content.keep(sector_bytes_, sector);
      if (fate == 1)
        Content::place(content.seen, sector_bytes_, sector, Content::sector(content.kept, sector_bytes_, sector));
    }
  }
  content.waiting.clear();
  return error;
}

int MemoryDisk::sync_names(const std::string& folder) {
  if (const int error = before_sync(); error != 0) return error;
  const auto here = [&](const auto& change) { return folder_of(change.front().first).string() == folder; };
  for (const auto& change : changes_)
    if (here(change))
      for (const auto& [name, content] : change) {
        synced_names_.erase(name);
        if (content) synced_names_.emplace(name, content);
      }
  std::erase_if(changes_, here);
  return 0;
}

int MemoryDisk::change_names(std::vector<std::pair<std::string, Contents>> change) {
  const int error = before_write();
  if (error != 0 && !off_) return error;
  for (const auto& [name, content] : change) {
    names_.erase(name);
    if (content) names_.emplace(name, content);
  }
  changes_.push_back(std::move(change));
  return error;
}

MemoryDisk::Contents MemoryDisk::find(const std::string& name) const {
  const auto found = names_.find(name);
  return found == names_.end() ? nullptr : found->second;
}

void MemoryDisk::lose_power(Content& content) {
  std::string left = content.kept;
  if (content.seen.size() != content.kept.size() && !chance(3)) {
    const std::size_t now = content.seen.size(), before = content.kept.size();
    left.resize(now < before || chance(2) ? now : before + random_() % (now - before), '\0');
  }
  for (const std::size_t at : content.waiting) {
    std::string sector = Content::sector(content.kept, sector_bytes_, at);
    const std::string written = Content::sector(content.seen, sector_bytes_, at);
    switch (random_() % 8) {
      case 0: {  // torn
        const std::size_t torn = random_() % sector_bytes_;
        sector.replace(0, torn, written, 0, torn);
        break;
      }
      case 1:  // spoiled
        for (char& byte : sector) byte = static_cast<char>(random_());
        break;
      case 2:
      case 3:
      case 4:
        sector = written;
        break;
      default:
        break;  // lost
    }
    Content::place(left, sector_bytes_, at, sector);
  }
  content.kept = left;
  content.seen = std::move(left);
  content.waiting.clear();
}

void MemoryDisk::power_returns() {
  OSTEON_CHECK(open_files_ == 0);
  // A file system with a journal loses the newest changes first. Others may lose any change.
  const bool in_order = chance(2);
  const std::size_t kept = random_() % (changes_.size() + 1);
  for (std::size_t i = 0; i < changes_.size(); ++i) {
    if (in_order ? i >= kept : chance(2)) continue;
    for (const auto& [name, content] : changes_[i]) {
      synced_names_.erase(name);
      if (content) synced_names_.emplace(name, content);
    }
  }
  changes_.clear();
  names_ = synced_names_;
  for (const auto& [name, content] : names_) lose_power(*content);
  ++boots_;
  off_ = false;
  mend();
}

void MemoryDisk::mend() {
  fault_ = write_fault_ = sync_fault_ = power_fault_ = {};
  failed_ = off_;
}

void MemoryDisk::fail_at(std::uint64_t n, int error, Lasting lasting) { fault_ = {n, error, lasting}; }
void MemoryDisk::fail_write_at(std::uint64_t n, int error, Lasting lasting) { write_fault_ = {n, error, lasting}; }
void MemoryDisk::fail_sync_at(std::uint64_t n, int error, Lasting lasting) { sync_fault_ = {n, error, lasting}; }
void MemoryDisk::fail_power_at(std::uint64_t n) { power_fault_ = {n, EIO, Lasting::once}; }

void MemoryDisk::flip_bit(const fs::path& file, std::uint64_t bit) {
  const Contents content = find(name_of(file));
  OSTEON_CHECK(content && bit / 8 < content->seen.size());
  for (std::string* bytes : {&content->seen, &content->kept})
    if (bit / 8 < bytes->size()) (*bytes)[bit / 8] = static_cast<char>((*bytes)[bit / 8] ^ (1 << (bit % 8)));
}

void MemoryDisk::cut(const fs::path& file, std::uint64_t size) {
  const Contents content = find(name_of(file));
  OSTEON_CHECK(content && size <= content->seen.size());
  content->seen.resize(size);
  content->kept = content->seen;
  content->waiting.clear();
}

void MemoryDisk::put(const fs::path& file, std::string bytes) {
  const auto content = std::make_shared<Content>();
  content->seen = content->kept = std::move(bytes);
  names_[name_of(file)] = synced_names_[name_of(file)] = content;
}

MemoryDisk::Image MemoryDisk::image() const {
  Image all;
  for (const auto& [name, content] : names_) all.emplace(name, content->seen);
  return all;
}

void MemoryDisk::load(const Image& image) {
  OSTEON_CHECK(open_files_ == 0);
  names_.clear();
  synced_names_.clear();
  changes_.clear();
  for (const auto& [name, bytes] : image) put(name, bytes);
}

// ---------------------------------------------------------------------------------------------- under the journal's
// files

class MemoryDisk::OpenFile final : public DiskFile {
 public:
  OpenFile(MemoryDisk& disk, fs::path file, Contents content)
      : disk_(disk), file_(std::move(file)), content_(std::move(content)) {
    ++disk_.open_files_;
  }
  ~OpenFile() override { --disk_.open_files_; }
  Result<void> write(std::string_view piece) override {
    return done_or(disk_.write_at(*content_, content_->seen.size(), piece), "write", file_);
  }
  Result<void> write_at(std::uint64_t from, std::string_view piece) override {
    return done_or(disk_.write_at(*content_, from, piece), "write", file_);
  }
  Result<void> sync() override { return done_or(disk_.sync(*content_), "sync", file_); }

 private:
  MemoryDisk& disk_;
  fs::path file_;
  Contents content_;
};

class MemoryDisk::HeldLock final : public DiskLock {
 public:
  HeldLock(Contents content, LockKind kind) : content_(std::move(content)), kind_(kind), boot_(content_->boot) {
    ++count();
  }
  ~HeldLock() override {
    if (content_->boot == boot_) --count();
  }
  HeldLock(const HeldLock&) = delete;
  HeldLock& operator=(const HeldLock&) = delete;

 private:
  int& count() { return kind_ == LockKind::exclusive ? content_->exclusive : content_->shared; }
  Contents content_;
  LockKind kind_;
  std::uint64_t boot_;
};

class MemoryDisk::Scratch final : public ScratchFolder {
 public:
  Scratch(MemoryDisk& disk, fs::path path) : disk_(disk), path_(std::move(path)) {}
  ~Scratch() override {
    const auto inside = [&](const auto& file) { return folder_of(file.first) == path_; };
    std::erase_if(disk_.names_, inside);
    std::erase_if(disk_.synced_names_, inside);
    std::erase_if(disk_.changes_, [&](const auto& change) { return inside(change.front()); });
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  [[nodiscard]] const fs::path& path() const override { return path_; }

 private:
  MemoryDisk& disk_;
  fs::path path_;
};

Result<std::unique_ptr<DiskFile>> MemoryDisk::create(const fs::path& file) {
  const std::string name = name_of(file);
  Contents content = find(name);
  if (content) {
    if (const int reason = truncate(*content, 0)) return cannot("create", file, reason);
  } else {
    content = std::make_shared<Content>();
    if (const int reason = change_names({{name, content}})) return cannot("create", file, reason);
  }
  return std::make_unique<OpenFile>(*this, file, std::move(content));
}

Result<std::unique_ptr<DiskFile>> MemoryDisk::open(const fs::path& file) {
  if (off_) return cannot("open", file, EIO);
  const std::string name = name_of(file);
  Contents content = find(name);
  if (!content) {
    content = std::make_shared<Content>();
    if (const int reason = change_names({{name, content}})) return cannot("open", file, reason);
  }
  return std::make_unique<OpenFile>(*this, file, std::move(content));
}

Result<std::string> MemoryDisk::read(const fs::path& file, std::uint64_t from, std::size_t most) {
  if (off_) return cannot("read", file, EIO);
  const Contents content = find(name_of(file));
  if (!content) return cannot("open", file, ENOENT);
  return from < content->seen.size() ? content->seen.substr(from, most) : std::string();
}

Result<std::optional<FileIdentity>> MemoryDisk::identity(const fs::path& file) {
  if (off_) return cannot("look at", file, EIO);
  const Contents content = find(name_of(file));
  if (!content) return std::nullopt;
  return FileIdentity{0, reinterpret_cast<std::uintptr_t>(content.get()), content->seen.size()};
}

Result<void> MemoryDisk::rename(const fs::path& from, const fs::path& to) {
  const Contents content = find(name_of(from));
  if (!content) return cannot("rename", from, ENOENT);
  return done_or(change_names({{name_of(from), nullptr}, {name_of(to), content}}), "rename", from);
}

Result<void> MemoryDisk::remove(const fs::path& file) {
  if (off_) return cannot("remove", file, EIO);
  if (!find(name_of(file))) return {};
  return done_or(change_names({{name_of(file), nullptr}}), "remove", file);
}

Result<void> MemoryDisk::sync_folder(const fs::path& folder) {
  return done_or(sync_names(name_of(folder)), "sync", folder);
}

Result<std::vector<std::string>> MemoryDisk::list(const fs::path& folder) {
  if (off_) return cannot("list", folder, EIO);
  std::vector<std::string> names;
  for (const auto& [name, content] : names_)
    if (folder_of(name) == folder.lexically_normal()) names.push_back(fs::path(name).filename().string());
  return names;
}

Result<std::unique_ptr<DiskLock>> MemoryDisk::lock(const fs::path& file, LockKind kind) {
  if (off_) return cannot("lock", file, EIO);
  Contents content = find(name_of(file));
  if (!content) return cannot("open", file, ENOENT);
  if (content->boot != boots_) content->exclusive = content->shared = 0;
  content->boot = boots_;
  if (content->exclusive != 0 || (kind == LockKind::exclusive && content->shared != 0))
    return failure(ErrorCode::exists, file.string() + " is held by another process");
  return std::make_unique<HeldLock>(std::move(content), kind);
}

Result<std::unique_ptr<ScratchFolder>> MemoryDisk::scratch_folder() {
  if (off_) return cannot("make a folder in", "/scratch", EIO);
  return std::make_unique<Scratch>(*this, "/scratch/" + std::to_string(++scratches_));
}

}  // namespace osteon::test
