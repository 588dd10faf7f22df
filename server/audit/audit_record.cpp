#include "server/audit/audit_record.hpp"

#include <sodium.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <ctime>
#include <nlohmann/json.hpp>
#include <span>
#include <utility>

namespace osteon {
namespace {

using Json = nlohmann::ordered_json;

// Keeps the signatures of records distinct from all other signatures of the same key.
constexpr std::string_view kSigned = "osteon-audit-1\n";
constexpr std::string_view kBeforeSignature = ",\"signature\":\"", kAfterSignature = "\"}";
constexpr std::size_t kSignatureDigits = 2 * sizeof(Signature::bytes);
constexpr std::size_t kLongestLine = std::size_t{1} << 20;

template <class Array>
std::string_view view(const Array& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

Digest signed_digest(std::string_view body) {
  Hasher hasher;
  hasher.bytes(std::as_bytes(std::span(kSigned)));
  hasher.bytes(std::as_bytes(std::span(body)));
  return hasher.finish();
}

tl::unexpected<Error> no_record(const std::string& why) { return failure(ErrorCode::invalid_input, why); }

}  // namespace

std::string hex_of(std::string_view bytes) {
  std::string hex(2 * bytes.size() + 1, '\0');
  sodium_bin2hex(hex.data(), hex.size(), reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  hex.pop_back();
  return hex;
}

Result<std::string> bytes_of_hex(std::string_view hex) {
  std::string bytes(hex.size() / 2, '\0');
  std::size_t size = 0;
  const int read = sodium_hex2bin(reinterpret_cast<unsigned char*>(bytes.data()), bytes.size(), hex.data(), hex.size(),
                                  nullptr, &size, nullptr);
  if (read != 0 || size != bytes.size() || hex_of(bytes) != hex) return no_record("these are not hexadecimal digits");
  return bytes;
}

std::string encode(AuditRecord& record, const SigningKey& key) {
  record.key = key.public_key();
  const Json fields{{"sequence", record.sequence}, {"time", record.time},
                    {"identity", record.identity}, {"action", record.action},
                    {"object", record.object},     {"result", record.result},
                    {"detail", record.detail},     {"previous", to_hex(record.previous)},
                    {"key", to_hex(record.key)}};
  // ASCII only, so that no reader mistakes a character of a name for a line end.
  std::string line = fields.dump(-1, ' ', true, Json::error_handler_t::replace);
  line.pop_back();  // "}"
  const Signature signature = key.sign(signed_digest(line));
  return line.append(kBeforeSignature).append(hex_of(view(signature.bytes))).append(kAfterSignature);
}

Result<AuditRecord> decode_record(std::string_view line) {
  constexpr std::size_t kTail = kBeforeSignature.size() + kSignatureDigits + kAfterSignature.size();
  if (line.size() <= kTail || !line.ends_with(kAfterSignature) ||
      line.substr(line.size() - kTail, kBeforeSignature.size()) != kBeforeSignature)
    return no_record("it does not end with a signature");
  const std::string_view body = line.substr(0, line.size() - kTail);
  const Result<std::string> signature =
      bytes_of_hex(line.substr(body.size() + kBeforeSignature.size(), kSignatureDigits));
  if (!signature) return no_record("its signature is not hexadecimal");
  AuditRecord record;
  try {
    const Json fields = Json::parse(std::string(body) + "}");
    record.sequence = fields.at("sequence").get<std::uint64_t>();
    const std::pair<const char*, std::string*> texts[]{{"time", &record.time},     {"identity", &record.identity},
                                                       {"action", &record.action}, {"object", &record.object},
                                                       {"result", &record.result}, {"detail", &record.detail}};
    for (const auto& [name, text] : texts) *text = fields.at(name).get<std::string>();
    const Result<Digest> previous = digest_from_hex(fields.at("previous").get<std::string>());
    const Result<PublicKey> key = parse_public_key(fields.at("key").get<std::string>());
    if (!previous || !key) return no_record("its \"previous\" or \"key\" is not 64 hexadecimal digits");
    record.previous = *previous;
    record.key = *key;
  } catch (const Json::exception&) {
    return no_record("it is not the JSON of a record");
  }
  Signature made;
  std::ranges::copy(*signature, made.bytes.begin());
  if (!verifies(record.key, signed_digest(body), made))
    return no_record("its signature does not fit it: it was changed");
  return record;
}

Digest hash_of_line(std::string_view line) {
  Hasher hasher;
  hasher.bytes(std::as_bytes(std::span(line)));
  return hasher.finish();
}

std::string rfc3339(std::chrono::system_clock::time_point time) {
  using namespace std::chrono;
  const auto second = floor<seconds>(time);
  const std::time_t since_1970 = system_clock::to_time_t(second);
  std::tm utc{};
  gmtime_r(&since_1970, &utc);
  std::array<char, 64> text{};
  const std::size_t size = std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%S", &utc);
  std::snprintf(text.data() + size, text.size() - size, ".%06dZ",
                static_cast<int>(duration_cast<microseconds>(time - second).count()));
  return text.data();
}

std::string clean_text(std::string_view text) {
  std::string kept(text.substr(0, kMostText));
  for (char& c : kept)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  // U+0080 to U+009F control a terminal as well.
  for (std::size_t i = 0; i + 1 < kept.size(); ++i)
    if (kept[i] == '\xc2' && static_cast<unsigned char>(kept[i + 1]) < 0xa0) kept[i] = kept[i + 1] = '?';
  // The library replaces bytes that are not UTF-8.
  return Json::parse(Json(kept).dump(-1, ' ', false, Json::error_handler_t::replace)).get<std::string>();
}

AuditIdentity clean(const AuditIdentity& who) {
  return {clean_text(who.person), clean_text(who.certificate), clean_text(who.ticket), clean_text(who.address)};
}

Result<std::uint64_t> for_each_line(Disk& disk, const std::filesystem::path& file,
                                    const std::function<bool(std::string_view line, std::uint64_t next)>& take) {
  std::string held;
  std::uint64_t begins = 0;  // offset of `held` in the file
  for (;;) {
    const Result<std::string> piece = disk.read(file, begins + held.size(), kLongestLine);
    if (!piece) return tl::unexpected(piece.error());
    if (piece->empty()) return std::uint64_t{held.size()};
    held += *piece;
    std::size_t from = 0;
    for (std::size_t end; (end = held.find('\n', from)) != std::string::npos; from = end + 1)
      if (!take(std::string_view(held).substr(from, end - from), begins + end + 1)) return std::uint64_t{0};
    held.erase(0, from);
    begins += from;
    if (held.size() > kLongestLine)
      return no_record(file.string() + " has a line of more than 1 MiB; it is no audit file");
  }
}

}  // namespace osteon
