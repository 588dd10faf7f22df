#include "tests/unit/journal/old_journals.hpp"

#include <gtest/gtest.h>
#include <sqlite3.h>

#include <cstdio>
#include <string>

#include "common/core/digest.hpp"
#include "tests/support/disk/journal_trials.hpp"

namespace osteon {
namespace {

std::string hex(const auto& bytes) {
  std::string text = "x'";
  for (const auto byte : bytes) {
    char digits[3];
    std::snprintf(digits, sizeof digits, "%02x", static_cast<unsigned>(static_cast<unsigned char>(byte)));
    text += digits;
  }
  return text + "'";
}

}  // namespace

void make_old_journal(const std::filesystem::path& file, int version, const std::vector<JournalEntry>& entries,
                      RowsIn where) {
  const bool timed = version > 1;
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(file.c_str(), &database), SQLITE_OK);
  const auto run = [&](const std::string& sql) {
    char* why = nullptr;
    ASSERT_EQ(sqlite3_exec(database, sql.c_str(), nullptr, nullptr, &why), SQLITE_OK) << why << " in " << sql;
  };
  run("PRAGMA journal_mode=WAL; PRAGMA wal_autocheckpoint=0");
  run(std::string("CREATE TABLE rows(place INTEGER PRIMARY KEY, ") + (timed ? "at_ns INTEGER NOT NULL, " : "") +
      "bytes BLOB NOT NULL, chain BLOB NOT NULL) STRICT");
  run("CREATE TABLE registers(name TEXT PRIMARY KEY, value BLOB NOT NULL, seal BLOB NOT NULL) STRICT, WITHOUT ROWID");
  run("CREATE TABLE checkpoints(place INTEGER PRIMARY KEY, chain BLOB NOT NULL, meta BLOB NOT NULL, size INTEGER NOT"
      " NULL, digest BLOB NOT NULL, seal BLOB NOT NULL) STRICT");
  run("CREATE TABLE people(pseudonym TEXT PRIMARY KEY, label TEXT NOT NULL, joined_day INTEGER NOT NULL,"
      " seal BLOB NOT NULL) STRICT, WITHOUT ROWID");
  run("PRAGMA application_id=0x4f73744a; PRAGMA user_version=" + std::to_string(version));
  Hasher seal;
  seal.text("register");
  seal.text("genesis");
  seal.text("bone");
  run("INSERT INTO registers VALUES('genesis', " + hex(std::string("bone")) + ", " + hex(seal.finish().bytes) + ")");
  run("PRAGMA wal_checkpoint(TRUNCATE)");
  std::vector<JournalEntry> so_far;
  for (const JournalEntry& entry : entries) {
    so_far.push_back(entry);
    run("INSERT INTO rows VALUES(" + std::to_string(entry.seq.value) + ", " +
        (timed ? std::to_string(entry.at_ns) + ", " : "") + hex(entry.bytes) + ", " +
        hex(test::plain_head("bone", so_far).chain.bytes) + ")");
  }
  if (where == RowsIn::sqlites_log) sqlite3_db_config(database, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
  ASSERT_EQ(sqlite3_close(database), SQLITE_OK);
  ASSERT_EQ(std::filesystem::exists(file.string() + "-wal"), where == RowsIn::sqlites_log);
}

}  // namespace osteon
