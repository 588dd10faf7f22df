// A change of an audit log is detected, and the changed line is named. An erased person is gone from the log, and the
// log still verifies.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>
#include <string>
#include <vector>

#include "server/audit/audit_check.hpp"
#include "server/audit/audit_log.hpp"
#include "server/audit/syslog.hpp"
#include "tests/support/disk/memory_disk.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using test::MemoryDisk;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

const std::filesystem::path kLog = "/rooms/audit.log", kPeople = "/rooms/audit.people";
const AuditIdentity kAnna{"anna", "0A1B", "00112233445566778899aabbccddeeff", "ipv4:10.0.0.7"};

std::shared_ptr<const SigningKeys> new_keys() { return std::make_shared<const SigningKeys>(SigningKey::make()); }

AuditEvent event(const std::string& object, const AuditIdentity& who = kAnna) {
  return {.who = who, .action = "CreateRoom", .object = object, .result = kOk};
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t from = 0, end; (end = text.find('\n', from)) != std::string::npos; from = end + 1)
    lines.push_back(text.substr(from, end - from));
  return lines;
}
std::string text_of(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

class AuditLogs : public ::testing::Test {
 protected:
  AuditLog open(AuditLog::Unfit unfit = AuditLog::Unfit::refuse) { return open_with(keys_, unfit); }
  AuditLog open_with(const std::shared_ptr<const SigningKeys>& keys, AuditLog::Unfit unfit) {
    auto log = AuditLog::open(disk_, kLog, keys, unfit);
    EXPECT_TRUE(log.has_value()) << (log ? "" : log.error().message);
    return std::move(*log);
  }
  // Appends the records one after the other. Returns the lines.
  std::vector<std::string> fill(int records) {
    AuditLog log = open();
    for (int i = 0; i < records; ++i) {
      const AuditEvent one = event("room-" + std::to_string(i));
      EXPECT_TRUE(log.append({&one, 1}).has_value());
    }
    return lines_of(text());
  }
  std::string text() {
    const auto read = disk_.read(kLog, 0, 1 << 24);
    return read ? *read : std::string();
  }
  AuditReport verify(const std::optional<Digest>& expected = {}) {
    const auto report = verify_audit(
        disk_, kLog, [this](const PublicKey& key) { return keys_->trusts(key); }, expected);
    EXPECT_TRUE(report.has_value()) << (report ? "" : report.error().message);
    return report ? *report : AuditReport{};
  }
  std::string fault_of(const std::vector<std::string>& lines) {
    disk_.put(kLog, text_of(lines));
    return verify().fault.value_or("");
  }
  std::vector<AuditEntry> entries() {
    std::vector<AuditEntry> all;
    EXPECT_TRUE(read_audit(disk_, kLog, [&](const AuditEntry& one) { all.push_back(one); }));
    return all;
  }

  MemoryDisk disk_{1};
  std::shared_ptr<const SigningKeys> keys_ = new_keys();
};

TEST_F(AuditLogs, SayWhoDidWhat) {
  fill(3);
  const AuditReport report = verify();
  EXPECT_TRUE(report.sound()) << *report.fault;
  EXPECT_EQ(report.records, 3u);
  EXPECT_EQ(report.last, 3u);
  const auto all = entries();
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(all[2].who, kAnna);
  EXPECT_EQ(all[2].record.object, "room-2");
  EXPECT_THAT(text(), Not(HasSubstr("anna")));
}

TEST_F(AuditLogs, NameTheLineInWhichAnyByteWasChanged) {
  const std::string whole = text_of(fill(5));
  int line = 1;
  for (std::size_t at = 0; at + 1 < whole.size(); ++at) {
    std::string changed = whole;
    changed[at] = static_cast<char>(changed[at] ^ (1 << at % 7));
    disk_.put(kLog, changed);
    ASSERT_THAT(verify().fault.value_or("sound"), StartsWith("line " + std::to_string(line) + ": ")) << "byte " << at;
    if (whole[at] == '\n') ++line;
  }
}

TEST_F(AuditLogs, NameTheLineThatIsMissingRepeatedMovedOrPutIn) {
  const std::vector<std::string> whole = fill(6);
  auto lines = whole;
  lines.erase(lines.begin() + 2);
  EXPECT_THAT(fault_of(lines), StartsWith("line 3: 1 records are missing before it"));
  lines = whole;
  lines.erase(lines.begin());
  EXPECT_THAT(fault_of(lines), StartsWith("line 1: all records before number 2 are missing"));
  lines = whole;
  std::swap(lines[1], lines[2]);
  EXPECT_THAT(fault_of(lines), StartsWith("line 2: 1 records are missing before it"));
  lines = whole;
  lines.insert(lines.begin() + 3, whole[2]);
  EXPECT_THAT(fault_of(lines), StartsWith("line 4: it is repeated or out of order"));
  lines = whole;
  // A record of another log of the same server has a valid signature.
  ASSERT_TRUE(disk_.remove(kLog));
  const std::vector<std::string> others = fill(6);
  lines[3] = others[3];
  EXPECT_THAT(fault_of(lines), StartsWith("line 4: it does not follow on the line before it"));
  EXPECT_EQ(fault_of({}), "there is no record in it; a log has at least that of the server's start");
}

TEST_F(AuditLogs, NameTheLineThatAnotherKeySigned) {
  const std::vector<std::string> whole = fill(4);
  const SigningKey forger = SigningKey::make();
  auto lines = whole;
  AuditRecord record = *decode_record(lines[2]);
  record.object = "somewhere else";
  lines[2] = encode(record, forger);
  EXPECT_THAT(fault_of(lines), StartsWith("line 3: it is signed by an unknown key, " + to_hex(forger.public_key())));
  // All entries from one on are signed by the other key.
  Digest previous = hash_of_line(lines[1]);
  for (std::size_t i = 2; i < lines.size(); ++i) {
    record = *decode_record(lines[i]);
    record.previous = previous;
    lines[i] = encode(record, forger);
    previous = hash_of_line(lines[i]);
  }
  EXPECT_THAT(fault_of(lines), StartsWith("line 3: it is signed by an unknown key"));
  // The record names the key of the server.
  std::string& last = lines.back();
  last.replace(last.find(to_hex(forger.public_key())), 64, to_hex(keys_->key().public_key()));
  lines[2] = last;
  EXPECT_THAT(fault_of(lines), StartsWith("line 3: its signature does not fit it"));
}

TEST_F(AuditLogs, AreFoundToBeShorterByTheHashOfARecordAlone) {
  auto lines = fill(4);
  const Digest last = verify().last_hash, earlier = hash_of_line(lines[1]);
  EXPECT_TRUE(verify(last).sound());
  EXPECT_TRUE(verify(earlier).sound()) << "more records were added since";
  lines.pop_back();
  disk_.put(kLog, text_of(lines));
  EXPECT_TRUE(verify().sound()) << "nothing in the log shows that there were more records";
  EXPECT_THAT(verify(last).fault.value_or(""), HasSubstr("records are missing after line 3"));
}

// The process that wrote the records still knows how many there were.
TEST_F(AuditLogs, ThatAreCutWhileTheServerRunsHaveAGap) {
  AuditLog log = open();
  const std::vector<AuditEvent> some{event("a"), event("b"), event("c")};
  ASSERT_TRUE(log.append(some));
  auto lines = lines_of(text());
  lines.pop_back();
  disk_.put(kLog, text_of(lines));
  ASSERT_TRUE(log.append(some));
  EXPECT_THAT(verify().fault.value_or(""), StartsWith("line 3: 1 records are missing before it"));
  ASSERT_TRUE(disk_.remove(kLog));
  ASSERT_TRUE(log.append(some));
  EXPECT_THAT(verify().fault.value_or(""), StartsWith("line 1: all records before number 7 are missing"));
}

TEST_F(AuditLogs, VerifyAfterOldRecordsWereRemoved) {
  const auto now = std::chrono::system_clock::now();
  AuditLog log = open();
  std::vector<AuditEvent> some{event("a", {.person = "ben"}), event("b"), event("c"), event("d")};
  for (std::size_t i = 0; i < some.size(); ++i) some[i].at = now - std::chrono::days(30 - i);
  ASSERT_TRUE(log.append(some));
  EXPECT_EQ(log.remove_before(now - std::chrono::days(28)).value(), 2u);
  EXPECT_TRUE(verify().sound()) << *verify().fault;
  EXPECT_EQ(verify().first, 3u);
  EXPECT_EQ(entries().back().record.action, kRetention);
  EXPECT_THAT(*disk_.read(kPeople, 0, 1 << 20), Not(HasSubstr("ben"))) << "no record names ben any more";
  EXPECT_THAT(*disk_.read(kPeople, 0, 1 << 20), HasSubstr("anna"));
  EXPECT_EQ(log.remove_before(now - std::chrono::days(28)).value(), 0u);
  // Nobody can remove more of the rest than the record says.
  auto lines = lines_of(text());
  const std::string kept = text();
  lines.erase(lines.begin());
  EXPECT_THAT(fault_of(lines), StartsWith("line 1: all records before number 4 are missing"));
  disk_.put(kLog, kept);
  // All records are removed, and the chain goes on.
  AuditLog again = open();
  EXPECT_EQ(again.remove_before(now + 1h).value(), 3u);
  EXPECT_EQ(verify().records, 1u);
  ASSERT_TRUE(again.append(some));
  EXPECT_TRUE(verify().sound()) << *verify().fault;
}

TEST_F(AuditLogs, EraseAPersonAndStayAsTheyAre) {
  AuditLog log = open();
  const AuditIdentity claimed{std::string(kClaimed) + "anna", "0A1B", "", "ipv4:10.0.0.9"};
  const std::vector<AuditEvent> some{event("a"), event("b", claimed), event("c", {.person = "ben"})};
  ASSERT_TRUE(log.append(some));
  const std::string before = text();
  EXPECT_EQ(erase_person(disk_, kLog, "anna").value(), 2u);
  EXPECT_EQ(text(), before);
  EXPECT_TRUE(verify().sound());
  EXPECT_THAT(*disk_.read(kPeople, 0, 1 << 20), Not(HasSubstr("anna")));
  const auto all = entries();
  EXPECT_TRUE(all[0].is_erased && all[1].is_erased);
  EXPECT_EQ(all[2].who.person, "ben");
  // A person who comes again is a new person.
  ASSERT_TRUE(log.append(some));
  EXPECT_NE(entries()[3].record.identity, all[0].record.identity);
  EXPECT_EQ(entries()[5].record.identity, all[2].record.identity);
}

TEST_F(AuditLogs, TakeNobodysWordForWhoItWas) {
  fill(1);
  std::string people = *disk_.read(kPeople, 0, 1 << 20);
  people.replace(people.find("\"anna\""), 6, "\"evan\"");
  disk_.put(kPeople, people);
  EXPECT_TRUE(entries()[0].is_erased);
  EXPECT_THAT(verify().notes, testing::ElementsAre(HasSubstr("do not fit their pseudonyms")));
}

TEST_F(AuditLogs, TakeNoNameForALine) {
  AuditLog log = open();
  const std::string signed_line = lines_of((fill(1), text()))[0];
  const std::string names[]{"a\nb",
                            "a\r\n" + signed_line + "\n",
                            std::string("a\0b", 3),
                            "\x1b[2J",
                            "\xff\xfe\xc3(",
                            "\xe2\x80\xa8 \xc2\x85",
                            "\"}\n{\"",
                            std::string(1 << 20, 'x'),
                            std::string(300, '\xc3'),
                            "\\\"]"};
  std::vector<AuditEvent> some;
  for (const std::string& name : names)
    some.push_back({.who = {name, name, name, name}, .action = name, .object = name, .result = name, .detail = name});
  const auto written = log.append(some);
  ASSERT_TRUE(written.has_value()) << written.error().message;
  EXPECT_TRUE(verify().sound()) << *verify().fault;
  EXPECT_EQ(verify().records, 1 + std::size(names));
  const auto is_plain = [](char c) { return c == '\n' || (c >= 0x20 && c < 0x7f); };
  EXPECT_TRUE(std::ranges::all_of(text(), is_plain));
  EXPECT_LT(text().size(), std::size(names) * 16384);
  for (const AuditEntry& one : entries()) EXPECT_FALSE(one.is_erased);
  for (std::size_t i = 0; i < std::size(names); ++i) {
    const std::string message = syslog_message((*written)[i].record, clean(some[i].who), (*written)[i].hash);
    EXPECT_EQ(std::ranges::count_if(message, [](char c) { return static_cast<unsigned char>(c) < 0x20; }), 0)
        << message;
    EXPECT_LT(message.size(), 16384u);
  }
  EXPECT_THAT(syslog_message((*written)[9].record, clean(some[9].who), {}), HasSubstr("person=\"\\\\\\\"\\]\""));
}

// At every write and sync of an append: the disk is full once, and the record that is tried again is in the log once.
TEST_F(AuditLogs, AreWholeAfterAFullDisk) {
  for (const int error : {ENOSPC, EIO})
    for (std::uint64_t n = 1; n <= 12; ++n) {
      disk_.load({});
      disk_.mend();
      AuditLog log = open();
      const std::vector<AuditEvent> first{event("a")}, more{event("b", {.person = "ben"}), event("c"), event("d")};
      ASSERT_TRUE(log.append(first));
      disk_.fail_at(n, error);
      const bool done = log.append(more) || log.append(more);
      ASSERT_TRUE(done) << n;
      disk_.mend();
      ASSERT_TRUE(log.append(first));
      const AuditReport report = verify();
      EXPECT_TRUE(report.sound()) << *report.fault << " after " << n;
      EXPECT_EQ(report.records, 5u) << n;
      for (const AuditEntry& one : entries()) EXPECT_FALSE(one.is_erased) << n;
    }
}

// A power failure may spoil the sector of the last records. Then the log is reported as damaged; it is never only
// shorter.
TEST_F(AuditLogs, KeepWhatWasAcknowledgedWhenThePowerFailsOrSayThatItIsDamaged) {
  int whole = 0;
  for (std::uint64_t n = 1; n <= 40; ++n) {
    MemoryDisk disk(n);
    std::uint64_t acknowledged = 0;
    {
      disk.fail_power_at(n);
      auto log = AuditLog::open(disk, kLog, keys_, AuditLog::Unfit::set_aside);
      const std::vector<AuditEvent> some{event("a"), event("b", {.person = "ben"})};
      while (log && acknowledged < 40 && log->append(some)) acknowledged += 2;
    }
    disk.power_returns();
    auto again = AuditLog::open(disk, kLog, keys_, AuditLog::Unfit::set_aside);
    ASSERT_TRUE(again.has_value()) << again.error().message;
    const AuditEvent last = event("last");
    ASSERT_TRUE(again->append({&last, 1}));
    const auto report = verify_audit(disk, kLog, [this](const PublicKey& key) { return keys_->trusts(key); });
    ASSERT_TRUE(report.has_value());
    std::string first;
    EXPECT_TRUE(
        read_audit(disk, kLog, [&](const AuditEntry& one) { first = first.empty() ? one.record.action : first; }));
    if (!report->sound() || first == "set-aside") continue;
    EXPECT_GT(report->records, acknowledged) << n;
    ++whole;
  }
  EXPECT_GT(whole, 10);
}

TEST_F(AuditLogs, ThatAreDamagedOrAnothersAreSetAsideByAServer) {
  auto lines = fill(2);
  lines[1][20] ^= 1;
  disk_.put(kLog, text_of(lines));
  const auto refused = AuditLog::open(disk_, kLog, keys_, AuditLog::Unfit::refuse);
  ASSERT_FALSE(refused.has_value());
  EXPECT_THAT(refused.error().message, HasSubstr("its last line is damaged"));
  const auto begin_anew = [&](const std::shared_ptr<const SigningKeys>& keys) {
    AuditLog log = open_with(keys, AuditLog::Unfit::set_aside);
    const AuditEvent one = event("new");
    EXPECT_TRUE(log.append({&one, 1}));
    const auto all = entries();
    ASSERT_EQ(all.size(), 2u);
    EXPECT_EQ(all[0].record.action, "set-aside");
    EXPECT_EQ(disk_.read("/rooms/" + all[0].record.object, 0, 1 << 20).value().substr(0, 12), "{\"sequence\":");
  };
  begin_anew(keys_);
  begin_anew(new_keys());
}

TEST_F(AuditLogs, AreOneChainForSeveralWriters) {
  AuditLog server = open(), command = open();
  for (int i = 0; i < 5; ++i) {
    const AuditEvent by_server = event("s"), by_command = event("c", {.person = "system:root"});
    ASSERT_TRUE(server.append({&by_server, 1}));
    ASSERT_TRUE(command.append({&by_command, 1}));
    if (i == 2) {
      EXPECT_EQ(erase_person(disk_, kLog, "anna").value(), 1u);
    }
  }
  EXPECT_TRUE(verify().sound()) << *verify().fault;
  EXPECT_EQ(verify().records, 10u);
  EXPECT_EQ(std::ranges::count_if(entries(), &AuditEntry::is_erased), 3);
}

}  // namespace
}  // namespace osteon
