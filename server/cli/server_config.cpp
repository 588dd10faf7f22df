#include "server/cli/server_config.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>
#include <numeric>
#include <set>
#include <string_view>
#include <utility>

#include "common/runtime/files.hpp"
#include "common/wire/host_port.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

// What is wrong with a field's value. Caught where the file and the field are known.
struct Wrong {
  std::string what;
};

// A field's value and the folder of its file.
struct Value {
  const YAML::Node& node;
  const fs::path& folder;
};

std::string scalar(const Value& value, const char* remedy) {
  if (!value.node.IsScalar() || value.node.Scalar().empty())
    throw Wrong{std::string("is not a single value; ") + remedy};
  return value.node.Scalar();
}

double number(const Value& value, double least, double most) {
  const auto text_of = [](double n) {
    char text[32];
    return std::string(text, std::to_chars(text, text + sizeof text, n).ptr);
  };
  const std::string remedy = "write a number from " + text_of(least) + " to " + text_of(most);
  const std::string text = scalar(value, remedy.c_str());
  double read = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), read);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(read))
    throw Wrong{"is " + text + "; " + remedy};
  if (read < least || read > most) throw Wrong{"is " + text + "; " + remedy};
  return read;
}

int whole(const Value& value, int least, int most) {
  const double read = number(value, least, most);
  if (read != std::floor(read))
    throw Wrong{"is " + value.node.Scalar() + "; write a whole number from " + std::to_string(least) + " to " +
                std::to_string(most)};
  return static_cast<int>(read);
}

fs::path path(const Value& value) {
  const fs::path read = scalar(value, "write a path");
  return read.is_absolute() ? read : value.folder / read;
}

std::vector<fs::path> paths(const Value& value) {
  if (value.node.IsScalar()) return {path(value)};
  if (!value.node.IsSequence() || value.node.size() == 0)
    throw Wrong{"is not a path or a list of paths; write one, such as [skull, ear]"};
  std::vector<fs::path> all;
  for (const YAML::Node& one : value.node) all.push_back(path({one, value.folder}));
  return all;
}

std::string host_port(const Value& value, const char* remedy) {
  const std::string text = scalar(value, remedy);
  if (!parse_host_port(text, "")) throw Wrong{"is " + text + "; " + remedy};
  return text;
}

std::string metrics_place(const Value& value) {
  constexpr const char* kRemedy = "write a port, or one with a host of this machine alone, such as 127.0.0.1:9464";
  const std::string text = scalar(value, kRemedy);
  const Result<HostPort> at = parse_host_port(text.find(':') == std::string::npos ? "127.0.0.1:" + text : text, "");
  if (!at || !is_loopback(at->host)) throw Wrong{"is " + text + "; " + kRemedy};
  return text;
}

bool yes_or_no(const Value& value) {
  const std::string text = scalar(value, "write true or false");
  if (text == "true") return true;
  if (text == "false") return false;
  throw Wrong{"is " + text + "; write true or false"};
}

Detail detail(const Value& value) {
  constexpr const char* kRemedy = "write auto, full or near";
  const std::string text = scalar(value, kRemedy);
  if (text == "auto") return Detail::automatic;
  if (text == "full") return Detail::full;
  if (text == "near") return Detail::near;
  throw Wrong{"is " + text + "; " + kRemedy};
}

struct Field {
  std::string_view name;
  std::function<void(const Value&, ServerConfig&)> read;
};

const std::vector<Field>& fields() {
  using Config = ServerConfig;
  static const std::vector<Field> all{
      {"address_file", [](const Value& v, Config& c) { c.address_file = path(v); }},
      {"audit", [](const Value& v, Config& c) { c.audit_file = path(v); }},
      {"audit_retention_days", [](const Value& v, Config& c) { c.audit_retention_days = whole(v, 0, 36500); }},
      {"audit_syslog", [](const Value& v, Config& c) { c.audit_syslog = path(v); }},
      {"case_memory_mib", [](const Value& v, Config& c) { c.case_memory_mib = whole(v, 1, kMostCaseMemoryMib); }},
      {"cases", [](const Value& v, Config& c) { c.case_folders = paths(v); }},
      {"certificates", [](const Value& v, Config& c) { c.certificates = path(v); }},
      {"compliant_mount", [](const Value& v, Config& c) { c.mount = yes_or_no(v); }},
      {"detail", [](const Value& v, Config& c) { c.detail = detail(v); }},
      {"drain_seconds", [](const Value& v, Config& c) { c.drain_seconds = whole(v, 0, 600); }},
      {"journal", [](const Value& v, Config& c) { c.journal_file = path(v); }},
      {"listen",
       [](const Value& v, Config& c) { c.listen = host_port(v, "write HOST:PORT, such as 127.0.0.1:50000"); }},
      {"metrics", [](const Value& v, Config& c) { c.metrics = metrics_place(v); }},
      {"most_backups_per_person", [](const Value& v, Config& c) { c.most_backups_per_person = whole(v, 1, 65536); }},
      {"most_connections", [](const Value& v, Config& c) { c.most_connections = whole(v, 1, 65535); }},
      {"most_rooms", [](const Value& v, Config& c) { c.most_rooms = whole(v, 1, 65536); }},
      {"most_rooms_per_person", [](const Value& v, Config& c) { c.most_rooms_per_person = whole(v, 1, 65536); }},
      {"most_ticket_hours", [](const Value& v, Config& c) { c.most_ticket_hours = whole(v, 1, 87600); }},
      {"plain", [](const Value& v, Config& c) { c.plain = yes_or_no(v); }},
      {"proxy_socket", [](const Value& v, Config& c) { c.proxy_socket = path(v); }},
      {"resume", [](const Value& v, Config& c) { c.resume_file = path(v); }},
      {"retention_days", [](const Value& v, Config& c) { c.retention_days = whole(v, 1, 36500); }},
      {"rooms", [](const Value& v, Config& c) { c.rooms_folder = path(v); }},
      {"save", [](const Value& v, Config& c) { c.save_file = path(v); }},
      {"signing_key", [](const Value& v, Config& c) { c.signing_key = path(v); }},
      {"summary", [](const Value& v, Config& c) { c.summary_file = path(v); }},
      {"tools", [](const Value& v, Config& c) { c.tools_folder = path(v); }},
      {"udp_listen",
       [](const Value& v, Config& c) { c.udp_listen = host_port(v, "write HOST:PORT, such as 0.0.0.0:50000"); }},
      {"uploads", [](const Value& v, Config& c) { c.uploads_folder = path(v); }},
  };
  return all;
}

const std::vector<Field>& limit_fields() {
  using Config = ServerConfig;
  static const std::vector<Field> all{
      {"beyond_bone_mm", [](const Value& v, Config& c) { c.limits.beyond_bone_mm = number(v, 1, 1000); }},
      {"blow_j", [](const Value& v, Config& c) { c.limits.blow_j = number(v, 0, 1000); }},
      {"path_knots", [](const Value& v, Config& c) { c.limits.path_knots = whole(v, 2, 64); }},
      {"power_w", [](const Value& v, Config& c) { c.limits.power_w = number(v, 1, 100000); }},
      {"spindle_rpm",
       [](const Value& v, Config& c) { c.limits.spindle_rpm = static_cast<std::uint32_t>(whole(v, 1, 1000000)); }},
      {"swept_mm", [](const Value& v, Config& c) { c.limits.swept_mm = number(v, 1, 1000); }},
      {"swept_voxels_per_s", [](const Value& v, Config& c) { c.limits.swept_voxels_per_s = number(v, 1e6, 1e12); }},
      {"time_slack_ms",
       [](const Value& v, Config& c) { c.limits.time_slack = std::chrono::milliseconds(whole(v, 1, 60000)); }},
  };
  return all;
}

// Edit distance: number of letters to insert, remove or replace to turn one word into the other.
std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> costs(b.size() + 1);
  std::iota(costs.begin(), costs.end(), 0u);
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = costs[0];
    costs[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t same = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = costs[j + 1];
      costs[j + 1] = std::min({same, costs[j] + 1, diagonal + 1});
    }
  }
  return costs.back();
}

std::string nearest(std::string_view name, const std::vector<std::string>& known) {
  return *std::ranges::min_element(known, {}, [&](const std::string& one) { return distance(name, one); });
}

class Reader {
 public:
  Reader(const fs::path& file, ConfigRead& out) : file_(file), folder_(file.parent_path()), out_(out) {}

  void read(const YAML::Node& root) {
    if (!root.IsMap()) return fault(root, "is not a map of fields; write lines such as listen: 127.0.0.1:50000");
    read_map(root, fields(), "");
  }
  void fault(const YAML::Node& at, const std::string& what) { fault(at.Mark().line, what); }
  void fault(int line, const std::string& what) {
    out_.faults.push_back(file_.string() + ":" + std::to_string(line + 1) + ": " + what);
  }

 private:
  void read_map(const YAML::Node& map, const std::vector<Field>& known, const std::string& prefix) {
    std::set<std::string> seen;
    for (const auto& entry : map) {
      if (!entry.first.IsScalar()) {
        fault(entry.first, "a field's name is not a single word");
        continue;
      }
      const std::string name = entry.first.Scalar(), full = "\"" + prefix + name + "\"";
      const auto field = std::ranges::find(known, name, &Field::name);
      if (!seen.insert(name).second) {
        fault(entry.first, full + " is there twice; leave one");
      } else if (prefix.empty() && name == "limits") {
        if (entry.second.IsMap())
          read_map(entry.second, limit_fields(), "limits.");
        else
          fault(entry.second,
                "\"limits\" is not a map of limits; write lines such as power_w: 500 below it, further in");
      } else if (field == known.end()) {
        std::vector<std::string> names;
        for (const Field& one : known) names.emplace_back(one.name);
        if (prefix.empty()) names.emplace_back("limits");
        fault(entry.first, full + " is not a field; did you mean \"" + prefix + nearest(name, names) + "\"?");
      } else {
        try {
          field->read({entry.second, folder_}, out_.config);
        } catch (const Wrong& wrong) {
          fault(entry.second, full + " " + wrong.what);
        }
      }
    }
  }

  const fs::path file_, folder_;
  ConfigRead& out_;
};

bool is_there(const fs::path& path, bool folder) {
  std::error_code ignored;
  return folder ? fs::is_directory(path, ignored) : fs::is_regular_file(path, ignored);
}

}  // namespace

Result<ConfigRead> read_server_config(const fs::path& file, ServerConfig config) {
  const Result<std::string> text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  ConfigRead out{std::move(config), {}};
  Reader reader(file, out);
  try {
    reader.read(YAML::Load(*text));
  } catch (const YAML::Exception& error) {
    reader.fault(std::max(0, error.mark.line), "this is not YAML: " + error.msg);
  }
  return out;
}

Result<void> check_server_config(const ServerConfig& config) {
  const auto wrong = [](const std::string& what) -> Result<void> { return failure(ErrorCode::invalid_input, what); };
  if (config.case_folders.empty())
    return wrong("--case is required, or cases in the --config file; see osteon-server --help");
  if (config.case_folders.size() > 1 && config.rooms_folder.empty())
    return wrong("--case was given more than once, but there is one room; give --rooms FOLDER for many");
  const std::pair<const char*, bool> ways[]{{"--rooms", !config.rooms_folder.empty()},
                                            {"--journal", !config.journal_file.empty()},
                                            {"--resume", !config.resume_file.empty()}};
  for (std::size_t i = 0; i < std::size(ways); ++i)
    for (std::size_t j = i + 1; j < std::size(ways); ++j)
      if (ways[i].second && ways[j].second)
        return wrong(std::string(ways[i].first) + " excludes " + ways[j].first +
                     ", on the command line as in a --config file; leave one");
  if (!config.uploads_folder.empty() && config.rooms_folder.empty())
    return wrong(
        "--uploads needs --rooms, since a case that is uploaded is for rooms of its own; give --rooms FOLDER too");
  if (!config.signing_key.empty() && !ways[0].second && !ways[1].second)
    return wrong("--signing-key signs journals, and there are none; give --rooms FOLDER or --journal FILE too");
  if (!config.audit_syslog.empty() && config.audit_file.empty() && !ways[0].second && !ways[1].second)
    return wrong(
        "--audit-syslog sends audit records, and there are none; give --audit FILE, --rooms FOLDER or --journal FILE "
        "too");
  if (ways[0].second && !config.save_file.empty())
    return wrong("--rooms excludes --save, on the command line as in a --config file; leave one");
  if (config.plain && config.most_ticket_hours != 0)
    return wrong("--most-ticket-hours needs --certificates DIR: over plain text nobody has a ticket");
  if (config.plain && !config.proxy_socket.empty())
    return wrong("--proxy-socket needs --certificates DIR: a proxy passes on calls of people");
  if (config.plain == !config.certificates.empty())
    return wrong(config.plain ? "--plain excludes --certificates, on the command line as in a --config file; leave one"
                              : "say how clients connect: --certificates DIR, which deploy/certs makes, or --plain for "
                                "plain text on this machine alone");
  return {};
}

Result<void> check_server_places(const ServerConfig& config) {
  const auto missing = [](const char* what, const fs::path& path, const char* remedy) -> Result<void> {
    return failure(ErrorCode::not_found, std::string(what) + ": " + path.string() + " " + remedy);
  };
  for (const fs::path& folder : config.case_folders)
    if (!is_there(folder / "case.json", false))
      return missing("cases (--case)", folder, "is not a case; give a folder that osteon-import wrote");
  if (!config.tools_folder.empty() && !is_there(config.tools_folder, true))
    return missing("tools (--tools)", config.tools_folder, "is not a folder; give one with tool files");
  if (!config.resume_file.empty() && !is_there(config.resume_file, false))
    return missing("resume (--resume)", config.resume_file, "is not there; give a file that --save wrote");
  if (!config.certificates.empty() && !is_there(config.certificates / "server.pem", false))
    return missing("certificates (--certificates)", config.certificates,
                   "has no server.pem; give a folder that deploy/certs server made");
  const std::tuple<const char*, const fs::path&> written[]{{"address_file (--address-file)", config.address_file},
                                                           {"audit (--audit)", config.audit_file},
                                                           {"journal (--journal)", config.journal_file},
                                                           {"save (--save)", config.save_file},
                                                           {"summary (--summary)", config.summary_file},
                                                           {"signing_key (--signing-key)", config.signing_key},
                                                           {"rooms (--rooms)", config.rooms_folder},
                                                           {"uploads (--uploads)", config.uploads_folder}};
  for (const auto& [what, path] : written) {
    if (!path.empty() && !is_there(fs::absolute(path).parent_path(), true))
      return missing(what, path, "lies in a folder that is not there; make it");
  }
  return {};
}

std::vector<std::string> server_config_fields() {
  std::vector<std::string> names;
  for (const Field& field : fields()) names.emplace_back(field.name);
  for (const Field& field : limit_fields()) names.push_back("limits." + std::string(field.name));
  std::ranges::sort(names);
  return names;
}

}  // namespace osteon
