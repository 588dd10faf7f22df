#include "server/journal/database.hpp"

#include <sqlite3.h>

#include <cerrno>
#include <cstring>
#include <system_error>

#include "common/core/check.hpp"

namespace osteon {
namespace {

// One sentence from SQLite, with the system's reason if there is one.
Error error_of(sqlite3* connection, const std::string& file) {
  const int code = sqlite3_errcode(connection) & 0xff;  // without what the extended code adds
  const bool of_system = code == SQLITE_IOERR || code == SQLITE_FULL || code == SQLITE_CANTOPEN;
  const int reason = of_system ? sqlite3_system_errno(connection) : 0;
  std::string message = file + ": " + sqlite3_errmsg(connection);
  if (reason != 0) message += " (" + std::generic_category().message(reason) + ")";
  switch (code) {
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return {ErrorCode::exists, message + "; close it in the program that has it open"};
    case SQLITE_CORRUPT:
    case SQLITE_FORMAT:
      return {ErrorCode::invalid_input, message + "; salvage it into a new journal, or go on from a backup"};
    // Files that never were a journal are recognised before SQLite sees them.
    case SQLITE_NOTADB:
      return {ErrorCode::invalid_input, file + ": its first page is damaged; go on from a backup"};
    case SQLITE_READONLY:
      return {ErrorCode::internal, message + "; see to its permissions"};
    case SQLITE_FULL:
      return {ErrorCode::internal, message + std::string(remedy_of(ENOSPC))};
    case SQLITE_CANTOPEN:
      return {reason == ENOENT ? ErrorCode::not_found : ErrorCode::internal, message + std::string(remedy_of(reason))};
    default:
      return {ErrorCode::internal, message + std::string(remedy_of(reason))};
  }
}

// A path in the form in which SQLite accepts parameters after it. A torn write to SQLite's log may spoil what it has
// committed before, but the journal's own log still has that.
std::string uri_of(const std::filesystem::path& file) {
  static constexpr char kDigits[] = "0123456789ABCDEF";
  std::string uri = "file:";
  for (const char c : file.string()) {
    if (std::strchr("?#%", c) == nullptr) {
      uri += c;
      continue;
    }
    const auto byte = static_cast<unsigned char>(c);
    uri += '%';
    uri += kDigits[byte >> 4];
    uri += kDigits[byte & 15];
  }
  return uri;
}

}  // namespace

Statement& Statement::integer(int at, std::int64_t value) {
  OSTEON_CHECK(sqlite3_bind_int64(statement_.get(), at + 1, value) == SQLITE_OK);
  return *this;
}

Statement& Statement::text(int at, std::string_view value) {
  OSTEON_CHECK(sqlite3_bind_text64(statement_.get(), at + 1, value.empty() ? "" : value.data(), value.size(),
                                   SQLITE_STATIC, SQLITE_UTF8) == SQLITE_OK);
  return *this;
}

Statement& Statement::blob(int at, std::string_view value) {
  OSTEON_CHECK(sqlite3_bind_blob64(statement_.get(), at + 1, value.empty() ? "" : value.data(), value.size(),
                                   SQLITE_STATIC) == SQLITE_OK);
  return *this;
}

Result<bool> Statement::step() {
  const int code = sqlite3_step(statement_.get());
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  return tl::unexpected(error_of(sqlite3_db_handle(statement_.get()), file_));
}

Result<void> Statement::run() {
  Result<bool> more = true;
  while (more && *more) more = step();
  reset();
  if (!more) return tl::unexpected(more.error());
  return {};
}

void Statement::reset() { sqlite3_reset(statement_.get()); }

std::int64_t Statement::integer(int column) const { return sqlite3_column_int64(statement_.get(), column); }

std::string_view Statement::bytes(int column) const {
  const auto* data = static_cast<const char*>(sqlite3_column_blob(statement_.get(), column));
  return {data == nullptr ? "" : data, static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column))};
}

void Statement::Finalize::operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }

struct Database::Connection {
  sqlite3* handle = nullptr;
  std::string file;
};

void Database::Close::operator()(Connection* connection) const {
  // A statement that outlives the database would keep it open. Then it is closed with the statement.
  sqlite3_close_v2(connection->handle);
  delete connection;
}

Result<Database> Database::open(const std::filesystem::path& file, const Disk& disk, const DatabaseOptions& options) {
  Database made;
  made.connection_.reset(new Connection);
  Connection& connection = *made.connection_;
  connection.file = (options.shown_as.empty() ? file : options.shown_as).string();
  const std::string vfs = disk.vfs();
  const std::string uri = uri_of(file) + (options.peek ? "?immutable=1" : "");
  const int flags = (options.peek ? SQLITE_OPEN_READONLY : SQLITE_OPEN_READWRITE) | SQLITE_OPEN_URI |
                    SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_EXRESCODE | (options.create ? SQLITE_OPEN_CREATE : 0);
  const int code = sqlite3_open_v2(uri.c_str(), &connection.handle, flags, vfs.empty() ? nullptr : vfs.c_str());
  if (code != SQLITE_OK) return tl::unexpected(error_of(connection.handle, connection.file));
  // Otherwise SQLite opens the file read-only, and fails later for a reason of its own.
  if (!options.peek && sqlite3_db_readonly(connection.handle, "main") == 1)
    return failure(ErrorCode::internal,
                   connection.file + " cannot be written to; see to its permissions, or copy it to another place");
  sqlite3_db_config(connection.handle, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
  sqlite3_db_config(connection.handle, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  // EXCLUSIVE keeps the index of the log in memory. So there is no index file that another process could damage, and
  // nobody else uses the database.
  std::string settings =
      "PRAGMA locking_mode=EXCLUSIVE; PRAGMA temp_store=MEMORY; PRAGMA mmap_size=0; PRAGMA secure_delete=ON;"
      "PRAGMA cell_size_check=ON; PRAGMA cache_spill=OFF; PRAGMA trusted_schema=OFF; PRAGMA fullfsync=ON; PRAGMA "
      "checkpoint_fullfsync=ON;";
  if (options.create)
    settings += "PRAGMA page_size=" + std::to_string(options.page_bytes) + "; PRAGMA journal_mode=WAL;";
  settings += options.durable ? "PRAGMA synchronous=FULL;" : "PRAGMA synchronous=OFF;";
  if (Result<void> set = made.run(settings); !set) return tl::unexpected(set.error());
  return made;
}

Result<Statement> Database::prepare(std::string_view sql) {
  sqlite3_stmt* statement = nullptr;
  const int code = sqlite3_prepare_v3(connection_->handle, sql.data(), static_cast<int>(sql.size()),
                                      SQLITE_PREPARE_PERSISTENT, &statement, nullptr);
  if (code != SQLITE_OK) return tl::unexpected(error_of(connection_->handle, connection_->file));
  Statement made;
  made.statement_.reset(statement);
  made.file_ = connection_->file;
  return made;
}

Result<void> Database::run(const std::string& sql) {
  if (sqlite3_exec(connection_->handle, sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK)
    return tl::unexpected(error_of(connection_->handle, connection_->file));
  return {};
}

Result<std::int64_t> Database::integer(std::string_view sql) {
  return prepare(sql).and_then([](Statement statement) {
    return statement.step().map([&](bool row) { return row ? statement.integer(0) : std::int64_t{0}; });
  });
}

Result<std::string> Database::text(std::string_view sql) {
  return prepare(sql).and_then([](Statement statement) {
    return statement.step().map([&](bool row) { return row ? std::string(statement.bytes(0)) : std::string(); });
  });
}

Result<void> Database::begin() { return run("BEGIN IMMEDIATE"); }
Result<void> Database::commit() { return run("COMMIT"); }

Result<void> Database::carry_log() {
  const int code =
      sqlite3_wal_checkpoint_v2(connection_->handle, nullptr, SQLITE_CHECKPOINT_TRUNCATE, nullptr, nullptr);
  if (code != SQLITE_OK) return tl::unexpected(error_of(connection_->handle, connection_->file));
  return {};
}

void Database::forget_pages() { sqlite3_db_release_memory(connection_->handle); }

bool Database::read_only() const { return sqlite3_db_readonly(connection_->handle, "main") != 0; }

}  // namespace osteon
