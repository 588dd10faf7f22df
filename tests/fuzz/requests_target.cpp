#include "tests/fuzz/requests_target.hpp"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/core/check.hpp"
#include "common/wire/bone_motion.hpp"
#include "common/wire/convert.hpp"
#include "common/wire/version.hpp"
#include "osteon/v1/cutting.pb.h"
#include "osteon/v1/people.pb.h"
#include "osteon/v1/room.pb.h"
#include "osteon/v1/watch.pb.h"
#include "tests/fuzz/calls_messages.hpp"

namespace osteon::fuzz {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

struct Count {
  std::uint64_t runs = 0, messages = 0;  // messages: runs whose input could be parsed
};
std::map<std::string, Count> counts;   // by request
std::uint64_t taken = 0, refused = 0;  // values that the checks accepted, and refused

template <class Kind>
bool is(const Message& message) {
  return message.GetDescriptor() == Kind::descriptor();
}

// An accepted value must come back the same when it is sent on. A refused one must have a sentence as its reason.
template <class Kind>
bool converts(const Message& message) {
  if (!is<Kind>(message)) return false;
  const auto value = wire::from_wire(static_cast<const Kind&>(message));
  if (value) OSTEON_CHECK(wire::from_wire(wire::to_wire(*value)).has_value());
  if (!value) OSTEON_CHECK(!value.error().message.empty());
  ++(value ? taken : refused);
  return true;
}

template <class Value>
void note(const Result<Value>& value) {
  if (!value) OSTEON_CHECK(!value.error().message.empty());
  ++(value ? taken : refused);
}

void look_through(const Message& message) {
  if (converts<v1::Cut>(message) || converts<v1::CuttingState>(message) || converts<v1::SceneItem>(message) ||
      converts<v1::ToolDefinition>(message) || converts<v1::Restrictions>(message) ||
      converts<v1::Annotation>(message) || converts<v1::ViewFrustum>(message) || converts<v1::ShotRun>(message) ||
      converts<v1::ShotTotals>(message))
    return;
  if (is<v1::MountLoad>(message)) note(wire::from_wire(static_cast<const v1::MountLoad&>(message)));
  if (is<v1::SetSceneItemRequest>(message))
    note(wire::placing_from_wire(static_cast<const v1::SetSceneItemRequest&>(message)));
  if (is<v1::JoinRequest>(message))
    note(wire::check_protocol_version(static_cast<const v1::JoinRequest&>(message).protocol_version()));
  const auto& reflect = *message.GetReflection();
  std::vector<const FieldDescriptor*> fields;
  reflect.ListFields(message, &fields);
  for (const FieldDescriptor* field : fields) {
    if (field->type() == FieldDescriptor::TYPE_BYTES && !field->is_repeated()) {
      note(wire::digest_from_wire(reflect.GetString(message, field)));
    } else if (field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE && field->is_repeated()) {
      for (int i = 0; i < reflect.FieldSize(message, field); ++i)
        look_through(reflect.GetRepeatedMessage(message, field, i));
    } else if (field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
      look_through(reflect.GetMessage(message, field));
    }
  }
}

void read(std::span<const std::uint8_t> data) {
  if (data.empty()) return;
  const auto& type = *method_of(data[0]).input_type();
  Count& count = counts[type.name()];
  ++count.runs;
  auto& factory = *google::protobuf::MessageFactory::generated_factory();
  const std::unique_ptr<Message> request(factory.GetPrototype(&type)->New());
  if (!request->ParseFromArray(data.data() + 1, static_cast<int>(data.size() - 1))) return;
  ++count.messages;
  look_through(*request);
}

std::string figures() {
  if (counts.empty()) return "nothing";
  const auto least = std::ranges::min_element(counts, {}, [](const auto& one) { return one.second.runs; });
  std::uint64_t messages = 0;
  for (const auto& [name, count] : counts) messages += count.messages;
  return std::to_string(counts.size()) + " kinds of request, the fewest " + std::to_string(least->second.runs) +
         " of " + least->first + "; messages " + std::to_string(messages) + "; values taken " + std::to_string(taken) +
         ", refused " + std::to_string(refused);
}

}  // namespace

Target requests_target() {
  Target target{"requests", read, request_inputs(false)};
  target.change = change_request;
  target.figures = figures;
  return target;
}

}  // namespace osteon::fuzz
