// Requests of every call that a server takes, as inputs: the first byte says which call, the others are the request.
// For the sources of targets alone: generated types stay out of headers.
#pragma once
#include <cstdint>
#include <random>
#include <vector>

#include "common/volume/case.hpp"
#include "tests/fuzz/targets.hpp"

namespace google::protobuf {
class Message;
class MethodDescriptor;
}  // namespace google::protobuf

namespace osteon::fuzz {

inline constexpr const char* kRoom = "room";    // that calls are to
inline constexpr const char* kSpare = "spare";  // that calls may close or delete

[[nodiscard]] const Case& served_bone();  // whose hash such requests name

[[nodiscard]] const std::vector<const google::protobuf::MethodDescriptor*>& methods();
[[nodiscard]] const google::protobuf::MethodDescriptor& method_of(std::uint8_t which);
// The one beyond the last method: what is said in a session that was opened before.
[[nodiscard]] bool is_in_session(std::uint8_t which);

// Sound requests of all methods: one with everything in it, and one more for each further choice that it offers.
[[nodiscard]] std::vector<Bytes> request_inputs(bool in_sessions);
// Changes one field, somewhere in it, to what is rare or wrong.
void change_message(google::protobuf::Message& message, std::mt19937& random);
// The same of a request; nothing where the bytes are no message.
void change_request(Bytes& input, std::mt19937& random);

}  // namespace osteon::fuzz
