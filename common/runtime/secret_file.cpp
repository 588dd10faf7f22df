#include "common/runtime/secret_file.hpp"

#include <sys/stat.h>
#include <unistd.h>

namespace osteon {

std::optional<std::string> who_else_reads(const std::filesystem::path& file) {
  constexpr mode_t kGroup = S_IRGRP | S_IWGRP, kOthers = S_IROTH | S_IWOTH;
  struct stat about {};
  if (::stat(file.c_str(), &about) != 0) return {};
  const bool needs_no_group = about.st_uid == ::geteuid() || ::geteuid() == 0;
  const bool others = (about.st_mode & kOthers) != 0, group = (about.st_mode & kGroup) != 0 && needs_no_group;
  if (!others && !group) return {};
  const std::string name = file.string();
  return name + " is secret, and " + (others ? "everybody on this machine" : "its group") +
         " may read or write it; chmod " + (needs_no_group ? "600 " : "o= ") + name +
         ", and make the key anew if anybody may have read it";
}

}  // namespace osteon
