// deploy/certs beside a server that runs as a user of its own: the server can still read everything that it renews or
// revokes.
#include <grp.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <vector>

#include "common/access/access_list.hpp"
#include "tests/support/authentication/people.hpp"
#include "tests/support/process.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

struct Rights {
  uid_t owner = 0;
  gid_t group = 0;
  mode_t mode = 0;
  bool operator==(const Rights&) const = default;
};

Rights rights_of(const fs::path& file) {
  struct stat about {};
  EXPECT_EQ(::stat(file.c_str(), &about), 0) << file;
  return {about.st_uid, about.st_gid, about.st_mode};
}

// Returns true in the child process, which then runs as another user.
bool becomes(uid_t user, gid_t group) {
  return ::setgroups(0, nullptr) == 0 && ::setgid(group) == 0 && ::setuid(user) == 0;
}

// Whether another user can reach the test's files at all: the root of a chroot may be accessible only to its owner.
bool others_get_there(uid_t user, gid_t group) {
  const pid_t child = ::fork();
  if (child == 0)
    ::_exit(becomes(user, group) && ::access(fs::temp_directory_path().c_str(), R_OK | X_OK) == 0 ? 0 : 1);
  int status = 0;
  return ::waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

// Another user if this test may change its user, otherwise the same.
constexpr uid_t kOther = 64123;
constexpr gid_t kOthersGroup = 64124;
const bool kMayBeOthers = ::geteuid() == 0 && others_get_there(kOther, kOthersGroup);
const uid_t kServer = kMayBeOthers ? kOther : ::geteuid();
const gid_t kServersGroup = kMayBeOthers ? kOthersGroup : ::getegid();

// The number of entries in the list as the server's user reads it, -1 if it cannot.
int entries_for_the_server(const fs::path& file) {
  if (::geteuid() == 0 && !kMayBeOthers)
    std::printf("no other user gets to files of tests here: root reads %s itself\n", file.c_str());
  const pid_t child = ::fork();
  if (child == 0) {
    if (kMayBeOthers && !becomes(kServer, kServersGroup)) ::_exit(255);
    AccessFile list(file);
    ::_exit(list.refresh() ? static_cast<int>(list.list().size()) : 255);
  }
  int status = 0;
  EXPECT_EQ(::waitpid(child, &status, 0), child);
  return WIFEXITED(status) && WEXITSTATUS(status) != 255 ? WEXITSTATUS(status) : -1;
}

class Certs : public ::testing::Test {
 protected:
  // As the head of deploy/systemd/osteon-server.service says: the server reads through its group.
  Certs() {
    fs::permissions(people_.folder(), fs::perms(0711));
    fs::permissions(people_.server().parent_path(), fs::perms(0711));
    give(people_.server(), 0750);
    for (const auto& file : fs::directory_iterator(people_.server())) give(file, 0640);
  }
  static void give(const fs::path& path, mode_t mode) {
    EXPECT_EQ(::chown(path.c_str(), ::geteuid(), kServersGroup), 0) << path;
    EXPECT_EQ(::chmod(path.c_str(), mode), 0) << path;
  }
  test::People people_;
};

TEST_F(Certs, WhomTheyRevokeTheServerReadsOf) {
  const fs::path list = people_.server() / "access.txt";
  const Rights before = rights_of(list);
  ASSERT_EQ(entries_for_the_server(list), 0);
  (void)people_.person("ben");
  people_.certs({"revoke", "ben"});
  EXPECT_EQ(rights_of(list), before);
  EXPECT_EQ(entries_for_the_server(list), 1);
  // Also after a last line without a line end, and when there is no list yet.
  std::ofstream(list, std::ios::app) << "revoke user eve";
  (void)people_.person("dan");
  people_.certs({"revoke", "dan"});
  EXPECT_EQ(entries_for_the_server(list), 3);
  fs::remove(list);
  (void)people_.person("fay");
  people_.certs({"revoke", "fay"});
  EXPECT_EQ(rights_of(list), before);
  EXPECT_EQ(entries_for_the_server(list), 1);
}

TEST_F(Certs, WhatTheyRenewStaysReadable) {
  std::map<std::string, Rights> before;
  for (const auto& file : fs::directory_iterator(people_.server())) before[file.path().filename()] = rights_of(file);
  ASSERT_EQ(before.size(), 9u);
  const auto renewed = fs::last_write_time(people_.server() / "server.pem");
  people_.certs({"server", "127.0.0.1"});
  EXPECT_NE(fs::last_write_time(people_.server() / "server.pem"), renewed);
  for (const auto& [name, rights] : before) EXPECT_EQ(rights_of(people_.server() / name), rights) << name;
  EXPECT_EQ(std::distance(fs::directory_iterator(people_.server()), fs::directory_iterator{}), 9)
      << "no other file is left in the folder";
}

// For programs that check such a list. Osteon's programs do not.
TEST(CertsMade, NameTheListThatIsPublished) {
  test::People people;
  const auto shown = [&](const std::string& what, const std::vector<std::string>& how) {
    const fs::path file = people.server() / (what == "crl" ? "crl.der" : "server.pem");
    std::vector<std::string> arguments{what, "-in", file, "-noout"};
    arguments.insert(arguments.end(), how.begin(), how.end());
    return test::run("openssl", arguments).out;
  };
  EXPECT_EQ(shown("x509", {"-ext", "crlDistributionPoints"}).find("URI:"), std::string::npos);
  people.certs({"--crl-url", "http://ca.example.org/crl.der", "server", "127.0.0.1"});
  EXPECT_NE(shown("x509", {"-ext", "crlDistributionPoints"}).find("URI:http://ca.example.org/crl.der\n"),
            std::string::npos);
  EXPECT_EQ(shown("crl", {"-inform", "DER", "-text"}).find("Serial Number:"), std::string::npos);
  (void)people.person("ben");
  people.certs({"revoke", "ben"});
  EXPECT_NE(shown("crl", {"-inform", "DER", "-text"}).find("Serial Number:"), std::string::npos);
}

// The tool itself makes nothing accessible to others.
TEST(CertsMade, AreForTheirOwnerAlone) {
  const test::People people;
  for (const char* file : {"server.key", "access.txt"})
    EXPECT_EQ(rights_of(people.server() / file).mode & 0077u, 0u) << file;
  EXPECT_EQ(rights_of(people.ticket_key()).mode & 0077u, 0u);
}

}  // namespace
}  // namespace osteon
