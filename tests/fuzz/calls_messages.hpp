// Makes requests of every call that a server offers, as fuzz inputs. The first byte of an input selects the call. The
// other bytes are the request.
// Only the source files of targets include this header: generated types stay out of headers.
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

inline constexpr const char* kRoom = "room";    // the room that calls go to
inline constexpr const char* kSpare = "spare";  // a room that calls may close or delete

[[nodiscard]] const Case& served_bone();  // the case whose hash these requests name

[[nodiscard]] const std::vector<const google::protobuf::MethodDescriptor*>& methods();
[[nodiscard]] const google::protobuf::MethodDescriptor& method_of(std::uint8_t which);
// True for the number after the last method: a message in a session that was opened before.
[[nodiscard]] bool is_in_session(std::uint8_t which);

// Valid requests of all methods. Each method has one request with all fields set, and one more for each alternative of
// a oneof.
[[nodiscard]] std::vector<Bytes> request_inputs(bool in_sessions);
// Changes one field at a random depth to a rare or wrong value.
void change_message(google::protobuf::Message& message, std::mt19937& random);
// Does the same with a request. Leaves bytes alone that are not a message.
void change_request(Bytes& input, std::mt19937& random);

}  // namespace osteon::fuzz
