#include "server/audit/audit_people.hpp"

#include <sodium.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <span>

namespace osteon {
namespace {

using Json = nlohmann::ordered_json;
constexpr std::size_t kSaltBytes = 16, kPseudonymDigits = 32;

std::string pseudonym_of(const std::string& salt, const AuditIdentity& who) {
  Hasher hasher;
  for (const std::string* field : {&salt, &who.person, &who.certificate, &who.ticket, &who.address})
    hasher.text(*field);
  return to_hex(hasher.finish()).substr(0, kPseudonymDigits);
}

std::string line_of(const AuditPerson& one) {
  return Json{{"pseudonym", one.pseudonym},         {"salt", one.salt},         {"person", one.who.person},
              {"certificate", one.who.certificate}, {"ticket", one.who.ticket}, {"address", one.who.address}}
             .dump(-1, ' ', true, Json::error_handler_t::replace) +
         "\n";
}

std::optional<AuditPerson> person_of(std::string_view line) {
  try {
    const Json fields = Json::parse(line);
    const auto text = [&](const char* name) { return fields.at(name).get<std::string>(); };
    return AuditPerson{
        text("pseudonym"), text("salt"), {text("person"), text("certificate"), text("ticket"), text("address")}};
  } catch (const Json::exception&) {
    return {};
  }
}

}  // namespace

bool AuditPerson::fits() const { return pseudonym == pseudonym_of(salt, who); }

std::filesystem::path people_file_of(const std::filesystem::path& log) {
  const std::string name = log.filename().string();
  return folder_of(log) / (name.substr(0, name.find('.')) + ".people");
}

bool is_of(const AuditIdentity& who, std::string_view person) {
  std::string_view name = who.person;
  if (name.starts_with(kClaimed)) name.remove_prefix(kClaimed.size());
  return !person.empty() && name == person;
}

Result<std::vector<AuditPerson>> read_people(Disk& disk, const std::filesystem::path& file, std::size_t* unreadable) {
  std::vector<AuditPerson> all;
  std::size_t wrong = 0;
  const Result<std::uint64_t> rest = for_each_line(disk, file, [&](std::string_view line, std::uint64_t) {
    if (std::optional<AuditPerson> one = person_of(line))
      all.push_back(std::move(*one));
    else
      ++wrong;
    return true;
  });
  if (!rest && rest.error().code != ErrorCode::not_found) return tl::unexpected(rest.error());
  if (unreadable != nullptr) *unreadable = wrong + (rest && *rest > 0 ? 1 : 0);  // an incomplete last line
  return all;
}

Result<void> AuditPeople::refresh() {
  const auto there = disk_->identity(file_);
  if (!there) return tl::unexpected(there.error());
  const bool same = *there ? seen_ && seen_->same_file(**there) && seen_->size == (*there)->size : !seen_;
  if (same && !failed_) return {};
  std::size_t unreadable = 0;
  const auto read = read_people(*disk_, file_, &unreadable);
  if (!read) return tl::unexpected(read.error());
  known_.clear();
  waiting_.clear();
  for (const AuditPerson& one : *read) known_.insert_or_assign(one.who, one.pseudonym);
  seen_ = *there;
  if (unreadable == 0 && !failed_) return {};
  failed_ = false;
  return erase_if([](const AuditPerson&) { return false; }).map([](std::size_t) {});
}

std::string AuditPeople::pseudonym(const AuditIdentity& who) {
  if (who == AuditIdentity{}) return {};
  if (const auto found = known_.find(who); found != known_.end()) return found->second;
  if (known_.size() >= kMost) known_.clear();
  std::string salt(kSaltBytes, '\0');
  randombytes_buf(salt.data(), salt.size());
  AuditPerson made{{}, hex_of(salt), who};
  made.pseudonym = pseudonym_of(made.salt, who);
  waiting_ += line_of(made);
  return known_.emplace(who, made.pseudonym).first->second;
}

Result<void> AuditPeople::save() {
  if (waiting_.empty()) return {};
  const std::uint64_t end = seen_ ? seen_->size : 0;
  // After an error the disk may show data that it has not stored. Then refresh() writes everything again.
  failed_ = true;
  auto file = disk_->open(file_);
  if (!file) return tl::unexpected(file.error());
  if (Result<void> written = (*file)->write_durably(end, waiting_); !written) return written;
  if (!seen_)
    if (Result<void> named = disk_->sync_folder(folder_of(file_)); !named) return named;
  const auto now = disk_->identity(file_);
  if (!now) return tl::unexpected(now.error());
  seen_ = *now;
  waiting_.clear();
  failed_ = false;
  return {};
}

Result<std::size_t> AuditPeople::erase_if(const std::function<bool(const AuditPerson&)>& gone) {
  const auto there = read_people(*disk_, file_);
  if (!there) return tl::unexpected(there.error());
  Result<DurableFile> rewritten = DurableFile::begin(*disk_, file_);
  if (!rewritten) return tl::unexpected(rewritten.error());
  std::size_t erased = 0;
  for (const AuditPerson& one : *there) {
    if (gone(one))
      ++erased;
    else if (const Result<void> put = rewritten->write(line_of(one)); !put)
      return tl::unexpected(put.error());
  }
  if (const auto done = rewritten->finish(); !done) return tl::unexpected(done.error());
  seen_.reset();
  return refresh().map([erased] { return erased; });
}

}  // namespace osteon
