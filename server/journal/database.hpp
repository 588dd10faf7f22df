// SQLite as the journal uses it: one connection that has the file to itself. A transaction is open most of the time and
// holds what the journal's own log has made durable. SQLite's write-ahead log has something only while it is committed.
// Errors are sentences; what SQLite returns stops here.
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

// One SQL statement, run any number of times. Columns and parameters count from 0.
class Statement {
 public:
  Statement& integer(int at, std::int64_t value);
  Statement& text(int at, std::string_view value);  // must stay until the next step
  Statement& blob(int at, std::string_view value);  // likewise
  [[nodiscard]] Result<bool> step();                // true: there is an entry
  [[nodiscard]] Result<void> run();                 // to its end; ready to run again
  void reset();

  [[nodiscard]] std::int64_t integer(int column) const;
  [[nodiscard]] std::string_view bytes(int column) const;  // of a text or blob, until the next step

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
  bool durable = true;  // false: SQLite waits for no write; for tests that must see entries lost
  int page_bytes = 4096;
  bool peek = false;  // reads the file as it lies there, without its log and beside whoever has it open
  std::filesystem::path shown_as = {};  // what errors name, where the file is a copy; empty: the file
};

// Not synchronised; one thread at a time.
class Database {
 public:
  [[nodiscard]] static Result<Database> open(const std::filesystem::path& file, const Disk& disk,
                                             const DatabaseOptions& options);
  // Closing carries nothing from the log into the file: that is for carry_log(), while it still can be told to have
  // failed.
  Database(Database&&) noexcept = default;
  Database& operator=(Database&&) noexcept = default;

  [[nodiscard]] Result<Statement> prepare(std::string_view sql);
  [[nodiscard]] Result<void> run(const std::string& sql);            // statements without entries that matter
  [[nodiscard]] Result<std::int64_t> integer(std::string_view sql);  // of the first entry; 0 without one
  [[nodiscard]] Result<std::string> text(std::string_view sql);
  // What is changed between the two is in memory until the second, which returns when SQLite's log has it durably.
  [[nodiscard]] Result<void> begin();
  [[nodiscard]] Result<void> commit();
  // Copies SQLite's log into the file, both synced, and cuts it to nothing. Outside of a transaction.
  [[nodiscard]] Result<void> carry_log();
  // What is read next comes from the disk, not from the pages that SQLite still has in memory.
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
