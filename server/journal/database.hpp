// SQLite for the journal: one connection that has the file to itself. A transaction is open most of the time. It holds
// what the journal's own log has made durable. SQLite's write-ahead log is used only while this transaction is
// committed. Errors are sentences; error codes of SQLite go no further than this file.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "common/core/result.hpp"
#include "server/journal/disk.hpp"

struct sqlite3;
struct sqlite3_stmt;

namespace osteon {

// One SQL statement, which can run many times. Columns and parameters count from 0.
class Statement {
 public:
  Statement& integer(int at, std::int64_t value);
  Statement& text(int at, std::string_view value);  // must remain valid until the next step
  Statement& blob(int at, std::string_view value);  // likewise
  [[nodiscard]] Result<bool> step();                // true: there is a result row
  [[nodiscard]] Result<void> run();                 // to its end; ready to run again
  void reset();

  [[nodiscard]] std::int64_t integer(int column) const;
  [[nodiscard]] std::string_view bytes(int column) const;  // of a text or blob, valid until the next step

 private:
  friend class Database;
  Statement() = default;
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const;
  };
  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
  std::string file_;
};

struct DatabaseOptions {
  bool create = false;
  bool durable = true;  // false: SQLite waits for no write; for tests in which entries must be lost
  int page_bytes = 4096;
  bool peek = false;  // reads the file as it is, without its log, while another process may have it open
  std::filesystem::path shown_as = {};  // what errors name if the file is a copy; empty: the file
};

// Not synchronised: one thread at a time.
class Database {
 public:
  [[nodiscard]] static Result<Database> open(const std::filesystem::path& file, const Disk& disk,
                                             const DatabaseOptions& options);
  // Closing copies nothing from the log into the file. That is the task of carry_log(), which can still report an
  // error.
  Database(Database&&) noexcept = default;
  Database& operator=(Database&&) noexcept = default;

  [[nodiscard]] Result<Statement> prepare(std::string_view sql);
  [[nodiscard]] Result<void> run(const std::string& sql);            // statements whose result rows do not matter
  [[nodiscard]] Result<std::int64_t> integer(std::string_view sql);  // of the first result row; 0 if there is none
  [[nodiscard]] Result<std::string> text(std::string_view sql);
  // Changes between the two calls stay in memory until commit(). It returns when SQLite's log has them durably.
  [[nodiscard]] Result<void> begin();
  [[nodiscard]] Result<void> commit();
  // Copies SQLite's log into the file, syncs both, and truncates the log. Call it outside of a transaction.
  [[nodiscard]] Result<void> carry_log();
  // The next reads come from the disk, not from the pages that SQLite has in memory.
  void forget_pages();
  [[nodiscard]] bool read_only() const;  // known once something was read

 private:
  Database() = default;
  struct Connection;
  struct Close {
    void operator()(Connection* connection) const;
  };
  std::unique_ptr<Connection, Close> connection_;
};

}  // namespace osteon
