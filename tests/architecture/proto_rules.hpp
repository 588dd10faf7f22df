// The rules of the protocol (STYLE: the protocol is a document), checked in the compiled descriptor.
#pragma once
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace google::protobuf {
class DescriptorPool;
class FileDescriptor;
}  // namespace google::protobuf

namespace osteon::test {

struct Protocol {
  std::shared_ptr<const google::protobuf::DescriptorPool> pool;  // shared by copies; owns the files
  std::vector<const google::protobuf::FileDescriptor*> files;
};

// Reads the bytes of a FileDescriptorSet with source info. Has no files if they cannot be read.
[[nodiscard]] Protocol load_protocol(std::string_view descriptor_set);

// Each of these functions returns one sentence for every fault, with the element's name. Empty if there are no faults.
[[nodiscard]] std::vector<std::string> comment_faults(const Protocol& protocol);  // on everything, units on fields
[[nodiscard]] std::vector<std::string> enum_faults(const Protocol& protocol);     // zero must be _UNSPECIFIED
// each RPC must have messages of its own
[[nodiscard]] std::vector<std::string> rpc_faults(const Protocol& protocol);
// `committed`: result of numbers() when the protocol was last committed. A field keeps its number and type for ever, a
// removed field is reserved, and a new field is committed with the change that adds it.
[[nodiscard]] std::vector<std::string> number_faults(const Protocol& protocol, std::string_view committed);

// One line for each field, enum value and RPC: "Cut.author = 1 uint64".
[[nodiscard]] std::vector<std::string> numbers(const Protocol& protocol);

}  // namespace osteon::test
