#include "tests/architecture/proto_rules.hpp"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <algorithm>
#include <functional>
#include <map>
#include <regex>
#include <set>
#include <sstream>

namespace osteon::test {
namespace {
namespace pb = google::protobuf;

template <class Element>
std::string comment_of(const Element* element) {
  pb::SourceLocation location;
  if (!element->GetSourceLocation(&location)) return {};
  return location.leading_comments + location.trailing_comments;
}

void visit_messages(const Protocol& protocol, const std::function<void(const pb::Descriptor*)>& visit) {
  const std::function<void(const pb::Descriptor*)> deep = [&](const pb::Descriptor* message) {
    visit(message);
    for (int i = 0; i < message->nested_type_count(); ++i) deep(message->nested_type(i));
  };
  for (const auto* file : protocol.files) {
    for (int i = 0; i < file->message_type_count(); ++i) deep(file->message_type(i));
  }
}

void visit_enums(const Protocol& protocol, const std::function<void(const pb::EnumDescriptor*)>& visit) {
  for (const auto* file : protocol.files) {
    for (int i = 0; i < file->enum_type_count(); ++i) visit(file->enum_type(i));
  }
  visit_messages(protocol, [&](const pb::Descriptor* message) {
    for (int i = 0; i < message->enum_type_count(); ++i) visit(message->enum_type(i));
  });
}

void visit_methods(const Protocol& protocol, const std::function<void(const pb::MethodDescriptor*)>& visit) {
  for (const auto* file : protocol.files) {
    for (int s = 0; s < file->service_count(); ++s) {
      for (int m = 0; m < file->service(s)->method_count(); ++m) visit(file->service(s)->method(m));
    }
  }
}

// Truth values need no unit, and neither do messages that hold their own units. Points and poses need the unit of the
// message that holds them.
bool needs_unit(const pb::FieldDescriptor* field) {
  if (field->type() == pb::FieldDescriptor::TYPE_BOOL) return false;
  if (field->type() != pb::FieldDescriptor::TYPE_MESSAGE) return true;
  static const std::set<std::string> geometric{"Vector3", "Pose", "Coord"};
  return geometric.count(field->message_type()->name()) > 0;
}

bool names_unit(const std::string& comment) {
  static const std::regex unit(
      R"((^|[\s;,(])(mm(\^[23])?|mm/s|s|ms|ns|seconds|microseconds|N|N mm|N/mm|g/cm\^3|HU|uGy|Gy cm\^2|radians|)"
      R"(hertz|Hz|revolutions per minute|steps of \S+( mm)?|samples( of the level)?|blocks|0 to \d+|id|count|number|)"
      R"(text|bytes|no unit|see there|unit as named by the holder)([\s;,.)]|$))");
  return std::regex_search(comment, unit);
}

std::string type_name(const pb::FieldDescriptor* field) {
  std::string name = field->is_repeated() ? "repeated " : "";
  if (field->type() == pb::FieldDescriptor::TYPE_MESSAGE) return name + field->message_type()->name();
  if (field->type() == pb::FieldDescriptor::TYPE_ENUM) return name + field->enum_type()->name();
  return name + field->type_name();
}

// The full name without the package.
template <class Element>
std::string short_name(const Element* element) {
  const std::string& package = element->file()->package();
  return element->full_name().substr(package.empty() ? 0 : package.size() + 1);
}

struct Entry {
  std::string key;    // "Cut.author"
  std::string owner;  // "Cut"
  int number = 0;     // -1 for an RPC
  std::string line;
};

std::vector<Entry> entries(const Protocol& protocol) {
  std::vector<Entry> result;
  const auto add = [&](const std::string& owner, const std::string& name, int number, const std::string& what) {
    const std::string key = owner + "." + name;
    result.push_back({key, owner, number, key + " = " + what});
  };
  visit_messages(protocol, [&](const pb::Descriptor* message) {
    for (int i = 0; i < message->field_count(); ++i) {
      const auto* field = message->field(i);
      add(short_name(message), field->name(), field->number(),
          std::to_string(field->number()) + " " + type_name(field));
    }
  });
  visit_enums(protocol, [&](const pb::EnumDescriptor* type) {
    for (int i = 0; i < type->value_count(); ++i) {
      add(short_name(type), type->value(i)->name(), type->value(i)->number(), std::to_string(type->value(i)->number()));
    }
  });
  visit_methods(protocol, [&](const pb::MethodDescriptor* method) {
    add(method->service()->name(), method->name(), -1,
        std::string(method->client_streaming() ? "stream " : "") + method->input_type()->name() + " -> " +
            (method->server_streaming() ? "stream " : "") + method->output_type()->name());
  });
  return result;
}

bool is_reserved(const Protocol& protocol, const std::string& owner, int number) {
  bool reserved = false;
  visit_messages(protocol, [&](const pb::Descriptor* message) {
    if (short_name(message) == owner) reserved |= message->IsReservedNumber(number);
  });
  visit_enums(protocol, [&](const pb::EnumDescriptor* type) {
    if (short_name(type) == owner) reserved |= type->IsReservedNumber(number);
  });
  return reserved;
}

bool owner_exists(const Protocol& protocol, const std::string& owner) {
  bool exists = false;
  visit_messages(protocol, [&](const pb::Descriptor* message) { exists |= short_name(message) == owner; });
  visit_enums(protocol, [&](const pb::EnumDescriptor* type) { exists |= short_name(type) == owner; });
  return exists;
}

}  // namespace

Protocol load_protocol(std::string_view descriptor_set) {
  pb::FileDescriptorSet set;
  if (!set.ParseFromArray(descriptor_set.data(), static_cast<int>(descriptor_set.size()))) return {};
  auto pool = std::make_shared<pb::DescriptorPool>();
  Protocol protocol;
  for (const auto& file : set.file()) {
    const auto* built = pool->BuildFile(file);
    if (built == nullptr) return {};
    protocol.files.push_back(built);
  }
  protocol.pool = std::move(pool);
  return protocol;
}

std::vector<std::string> comment_faults(const Protocol& protocol) {
  std::vector<std::string> faults;
  const auto require = [&](const auto* element) {
    const std::string comment = comment_of(element);
    if (comment.find_first_not_of(" \n") == std::string::npos) faults.push_back(element->full_name() + ": no comment");
    return comment;
  };
  visit_messages(protocol, [&](const pb::Descriptor* message) {
    // The comment of an RPC also explains its messages.
    const bool of_rpc = message->name().ends_with("Request") || message->name().ends_with("Response");
    if (!of_rpc) require(message);
    for (int i = 0; i < message->field_count(); ++i) {
      const auto* field = message->field(i);
      const std::string comment = require(field);
      if (!comment.empty() && needs_unit(field) && !names_unit(comment)) {
        faults.push_back(field->full_name() +
                         ": its comment names no unit (nor id, count, number, text, bytes, see there, no unit)");
      }
    }
  });
  visit_enums(protocol, [&](const pb::EnumDescriptor* type) {
    require(type);
    for (int i = 0; i < type->value_count(); ++i) require(type->value(i));
  });
  visit_methods(protocol, [&](const pb::MethodDescriptor* method) { require(method); });
  return faults;
}

std::vector<std::string> enum_faults(const Protocol& protocol) {
  std::vector<std::string> faults;
  visit_enums(protocol, [&](const pb::EnumDescriptor* type) {
    const auto* zero = type->FindValueByNumber(0);
    if (zero == nullptr || !zero->name().ends_with("_UNSPECIFIED")) {
      faults.push_back(type->full_name() + ": its value 0 must be named …_UNSPECIFIED");
    }
  });
  return faults;
}

std::vector<std::string> rpc_faults(const Protocol& protocol) {
  std::vector<std::string> faults;
  std::map<std::string, std::string> used_by;
  visit_methods(protocol, [&](const pb::MethodDescriptor* method) {
    const std::pair<const pb::Descriptor*, std::string> roles[] = {
        {method->input_type(), method->name() + "Request"}, {method->output_type(), method->name() + "Response"}};
    for (const auto& [message, wanted] : roles) {
      if (message->name() != wanted) {
        faults.push_back(method->full_name() + ": its message is " + message->name() + " and should be " + wanted);
      }
      const auto [user, first] = used_by.emplace(message->full_name(), method->full_name());
      if (!first) faults.push_back(method->full_name() + ": shares " + message->name() + " with " + user->second);
    }
  });
  return faults;
}

std::vector<std::string> number_faults(const Protocol& protocol, std::string_view committed) {
  std::vector<std::string> faults;
  std::map<std::string, Entry> now;
  for (const auto& entry : entries(protocol)) now.emplace(entry.key, entry);

  std::set<std::string> known;
  std::istringstream lines{std::string(committed)};
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line[0] == '#') continue;
    const auto equals = line.find(" = ");
    const std::string key = line.substr(0, equals);
    const std::string owner = key.substr(0, key.rfind('.'));
    known.insert(key);
    if (const auto found = now.find(key); found != now.end()) {
      if (found->second.line != line)
        faults.push_back(key + ": was \"" + line + "\", is \"" + found->second.line + "\"");
      continue;
    }
    const bool is_rpc = line.find(" -> ") != std::string::npos;
    const int number = is_rpc ? -1 : std::atoi(line.c_str() + equals + 3);
    if (!is_rpc && owner_exists(protocol, owner) && !is_reserved(protocol, owner, number)) {
      faults.push_back(key + ": removed, so its number " + std::to_string(number) + " must be reserved in " + owner);
    }
  }
  for (const auto& [key, entry] : now) {
    if (known.count(key) > 0) continue;
    faults.push_back(key + ": not yet in osteon.v1.numbers (the target update_proto_numbers adds it)");
  }
  return faults;
}

std::vector<std::string> numbers(const Protocol& protocol) {
  std::vector<std::string> lines;
  for (const auto& entry : entries(protocol)) lines.push_back(entry.line);
  return lines;
}

}  // namespace osteon::test
