#include "tests/fuzz/calls_messages.hpp"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <tuple>
#include <type_traits>
#include <utility>

#include "common/field/kernel.hpp"
#include "common/tools/tool.hpp"
#include "common/wire/convert.hpp"
#include "common/wire/version.hpp"
#include "osteon/v1/cases.pb.h"
#include "osteon/v1/cutting.pb.h"
#include "osteon/v1/field.pb.h"
#include "osteon/v1/people.pb.h"
#include "osteon/v1/room.pb.h"
#include "osteon/v1/rooms.pb.h"
#include "osteon/v1/watch.pb.h"
#include "tests/fuzz/samples.hpp"
#include "tests/support/scenes/bones.hpp"

namespace osteon::fuzz {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::MethodDescriptor;
using google::protobuf::Reflection;

constexpr int kDeepest = 5;

// Fills a message with known values. Field numbers alone would not make values that the server processes further.
bool fill_known(Message& message) {
  static const auto known = std::make_tuple(
      wire::to_wire(a_cut()), wire::to_wire(an_item()), wire::to_wire(a_supervision()), wire::to_wire(an_annotation()),
      wire::to_wire(a_state()), wire::to_wire(a_look()), wire::to_wire(builtin_tools()[0]));
  const auto is = [&](const Message& value) {
    if (message.GetDescriptor() != value.GetDescriptor()) return false;
    message.CopyFrom(value);
    return true;
  };
  return std::apply([&](const auto&... value) { return (is(value) || ...); }, known);
}

bool of_rooms(const FieldDescriptor& field) { return field.file() == v1::ListRoomsRequest::descriptor()->file(); }

std::string sound_text(const FieldDescriptor& field) {
  if (field.name() == "case_hash") return wire::to_wire(served_bone().hash());
  static const std::string tool = wire::to_wire(builtin_tools()[0].hash());
  if (field.name() == "tool_hash") return tool;
  if (field.type() == FieldDescriptor::TYPE_BYTES) return std::string(32, '\1');
  return of_rooms(field) ? kSpare : kRoom;
}

// Sets a field, or adds a value to a repeated field.
template <class Value>
using Put = void (Reflection::*)(Message*, const FieldDescriptor*, Value) const;
template <class Value>
void put(Message& message, const FieldDescriptor* field, Put<Value> add, Put<Value> set,
         std::type_identity_t<Value> value) {
  (message.GetReflection()->*(field->is_repeated() ? add : set))(&message, field, std::move(value));
}
Message& part(Message& message, const FieldDescriptor* field) {
  const Reflection& reflect = *message.GetReflection();
  return field->is_repeated() ? *reflect.AddMessage(&message, field) : *reflect.MutableMessage(&message, field);
}

std::uint32_t sound_number(const FieldDescriptor& field) {
  if (field.name() == "protocol_version") return wire::kProtocolVersion;
  return field.name() == "kernel_version" ? kKernelVersion : 1;
}

void fill(Message& message, int choice, int depth = 0) {
  using R = Reflection;
  if (fill_known(message)) return;
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const FieldDescriptor* field = message.GetDescriptor()->field(i);
    if (const auto* one = field->real_containing_oneof(); one && field->index_in_oneof() != choice % one->field_count())
      continue;
    const bool many = field->is_repeated();
    const std::uint32_t number = sound_number(*field);
    switch (field->cpp_type()) {
      case FieldDescriptor::CPPTYPE_MESSAGE:
        if (depth < kDeepest) fill(part(message, field), choice, depth + 1);
        break;
      case FieldDescriptor::CPPTYPE_STRING:
        put(message, field, &R::AddString, &R::SetString, sound_text(*field));
        break;
      case FieldDescriptor::CPPTYPE_UINT64:
        put(message, field, &R::AddUInt64, &R::SetUInt64, number);
        break;
      case FieldDescriptor::CPPTYPE_UINT32:
        put(message, field, &R::AddUInt32, &R::SetUInt32, number);
        break;
      case FieldDescriptor::CPPTYPE_INT32:
        for (int k = 0; k < (many ? 3 : 1); ++k) put(message, field, &R::AddInt32, &R::SetInt32, 1);
        break;
      case FieldDescriptor::CPPTYPE_INT64:
        put(message, field, &R::AddInt64, &R::SetInt64, 1);
        break;
      case FieldDescriptor::CPPTYPE_DOUBLE:
        put(message, field, &R::AddDouble, &R::SetDouble, 1);
        break;
      case FieldDescriptor::CPPTYPE_FLOAT:
        for (int k = 0; k < (many ? 4 : 1); ++k) put(message, field, &R::AddFloat, &R::SetFloat, 0.5f);
        break;
      case FieldDescriptor::CPPTYPE_BOOL:
        put(message, field, &R::AddBool, &R::SetBool, false);
        break;
      case FieldDescriptor::CPPTYPE_ENUM:
        put(message, field, &R::AddEnumValue, &R::SetEnumValue, 1);
        break;
    }
  }
}

template <class Values>
auto one_of(const Values& values, std::mt19937& random) {
  return values[random() % std::size(values)];
}

std::uint64_t odd_number(std::mt19937& random) {
  static constexpr std::array<std::uint64_t, 13> kOdd{
      0, 1, 2, 3, 5, 17, 255, 1'000'000, 0x7fffffff, 0x80000000, 0xffffffff, std::uint64_t{1} << 63, ~std::uint64_t{0}};
  return one_of(kOdd, random);
}

double odd_real(std::mt19937& random) {
  using Limits = std::numeric_limits<double>;
  static constexpr std::array<double, 14> kOdd{0.0,
                                               -0.0,
                                               1.0,
                                               -1.0,
                                               0.3,
                                               -2.7,
                                               1e-9,
                                               1e6,
                                               -1e6,
                                               1e300,
                                               Limits::infinity(),
                                               -Limits::infinity(),
                                               Limits::quiet_NaN(),
                                               Limits::denorm_min()};
  return one_of(kOdd, random);
}

std::string odd_text(const FieldDescriptor& field, std::mt19937& random) {
  static const std::array<std::string, 9> kOdd{
      "", "third", "..", "a/b", ".x", "x.vdb", std::string(300, 'a'), std::string(20'000, 'b'), std::string(1, '\0')};
  static const std::array<std::size_t, 5> kSizes{0, 1, 31, 32, 33};
  if (random() % 4 == 0) return sound_text(field);
  if (of_rooms(field) && random() % 64 == 0) return kRoom;
  return field.type() == FieldDescriptor::TYPE_BYTES ? std::string(one_of(kSizes, random), '\2') : one_of(kOdd, random);
}

void set_odd(Message& message, const FieldDescriptor* field, std::mt19937& random) {
  using R = Reflection;
  const std::uint64_t number = odd_number(random);
  switch (field->cpp_type()) {
    case FieldDescriptor::CPPTYPE_MESSAGE:
      fill(part(message, field), static_cast<int>(random() % 8), 1);
      break;
    case FieldDescriptor::CPPTYPE_STRING:
      put(message, field, &R::AddString, &R::SetString, odd_text(*field, random));
      break;
    case FieldDescriptor::CPPTYPE_UINT64:
      put(message, field, &R::AddUInt64, &R::SetUInt64, number);
      break;
    case FieldDescriptor::CPPTYPE_UINT32:
      put(message, field, &R::AddUInt32, &R::SetUInt32, static_cast<std::uint32_t>(number));
      break;
    case FieldDescriptor::CPPTYPE_INT32:
      put(message, field, &R::AddInt32, &R::SetInt32, static_cast<std::int32_t>(number));
      break;
    case FieldDescriptor::CPPTYPE_INT64:
      put(message, field, &R::AddInt64, &R::SetInt64, static_cast<std::int64_t>(number));
      break;
    case FieldDescriptor::CPPTYPE_DOUBLE:
      put(message, field, &R::AddDouble, &R::SetDouble, odd_real(random));
      break;
    case FieldDescriptor::CPPTYPE_FLOAT:
      put(message, field, &R::AddFloat, &R::SetFloat, static_cast<float>(odd_real(random)));
      break;
    case FieldDescriptor::CPPTYPE_BOOL:
      put(message, field, &R::AddBool, &R::SetBool, random() % 2 == 0);
      break;
    case FieldDescriptor::CPPTYPE_ENUM: {
      const auto value = random() % 4 == 0 ? static_cast<int>(number) : static_cast<int>(random() % 8);
      put(message, field, &R::AddEnumValue, &R::SetEnumValue, value);
      break;
    }
  }
}

std::unique_ptr<Message> request_of(const MethodDescriptor& method) {
  auto& factory = *google::protobuf::MessageFactory::generated_factory();
  return std::unique_ptr<Message>(factory.GetPrototype(method.input_type())->New());
}

}  // namespace

const std::vector<const MethodDescriptor*>& methods() {
  static const std::vector<const MethodDescriptor*> all = [] {
    std::vector<const MethodDescriptor*> found;
    for (const google::protobuf::FileDescriptor* file :
         {v1::GetStatusRequest::descriptor()->file(), v1::SessionRequest::descriptor()->file(),
          v1::WatchMeshRequest::descriptor()->file(), v1::ListRoomsRequest::descriptor()->file(),
          v1::SayRequest::descriptor()->file(), v1::UploadCaseRequest::descriptor()->file(),
          v1::WatchFieldRequest::descriptor()->file()})
      for (int s = 0; s < file->service_count(); ++s)
        for (int m = 0; m < file->service(s)->method_count(); ++m) found.push_back(file->service(s)->method(m));
    return found;
  }();
  return all;
}

const Case& served_bone() {
  static const Case bone = test::plain_block(6, 3, 0.5);
  return bone;
}

bool is_in_session(std::uint8_t which) { return which % (methods().size() + 1) == methods().size(); }
const MethodDescriptor& method_of(std::uint8_t which) {
  static const MethodDescriptor* const session = *std::ranges::find(
      methods(), std::string_view("Session"), [](const MethodDescriptor* method) { return method->name(); });
  return is_in_session(which) ? *session : *methods()[which % (methods().size() + 1)];
}

std::vector<Bytes> request_inputs(bool in_sessions) {
  std::vector<Bytes> inputs;
  for (std::size_t which = 0; which < methods().size() + (in_sessions ? 1 : 0); ++which) {
    const MethodDescriptor& method = method_of(static_cast<std::uint8_t>(which));
    const Descriptor& type = *method.input_type();
    int choices = 1;
    for (int i = 0; i < type.field_count(); ++i)
      if (const auto* one = type.field(i)->real_containing_oneof()) choices = std::max(choices, one->field_count());
    for (int choice = 0; choice < choices; ++choice) {
      const auto request = request_of(method);
      fill(*request, choice);
      const std::string bytes = request->SerializeAsString();
      inputs.push_back({static_cast<std::uint8_t>(which)});
      inputs.back().insert(inputs.back().end(), bytes.begin(), bytes.end());
    }
  }
  return inputs;
}

void change_message(Message& message, std::mt19937& random) {
  const Reflection& reflect = *message.GetReflection();
  const Descriptor& type = *message.GetDescriptor();
  if (type.field_count() == 0) return;
  const FieldDescriptor* field =
      type.field(static_cast<int>(random() % static_cast<std::uint32_t>(type.field_count())));
  const bool many = field->is_repeated();
  const int there = many ? reflect.FieldSize(message, field) : 0;
  if (field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE && random() % 4 != 0) {
    if (many && there > 0) {
      const auto which = static_cast<int>(random() % static_cast<std::uint32_t>(there));
      return change_message(*reflect.MutableRepeatedMessage(&message, field, which), random);
    }
    if (!many && reflect.HasField(message, field))
      return change_message(*reflect.MutableMessage(&message, field), random);
  }
  switch (random() % 4) {
    case 0:
      return reflect.ClearField(&message, field);
    case 1:
      if (there > 0) return reflect.RemoveLast(&message, field);
      break;
    case 2:
      if (there > 1) return reflect.SwapElements(&message, field, 0, there - 1);
      break;
    default:
      break;
  }
  set_odd(message, field, random);
}

void change_request(Bytes& input, std::mt19937& random) {
  if (input.empty()) return;
  const auto request = request_of(method_of(input[0]));
  if (!request->ParseFromArray(input.data() + 1, static_cast<int>(input.size() - 1))) return;
  change_message(*request, random);
  const std::string bytes = request->SerializeAsString();
  input.resize(1);
  input.insert(input.end(), bytes.begin(), bytes.end());
}

}  // namespace osteon::fuzz
