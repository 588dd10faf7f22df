// Checks the protocol by its rules, and shows with small wrong protocols that each rule can fail.
#include <gmock/gmock.h>
#include <google/protobuf/compiler/parser.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/io/tokenizer.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <gtest/gtest.h>
#include <fstream>
#include <iterator>

#include "tests/architecture/proto_rules.hpp"

namespace osteon::test {
namespace {
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::string content(const char* file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

Protocol ours() { return load_protocol(content(OSTEON_DESCRIPTOR)); }

// A protocol written in a test.
Protocol parsed(const std::string& body) {
  const std::string text = "syntax = \"proto3\"; package osteon.v1;\n" + body;
  google::protobuf::io::ArrayInputStream stream(text.data(), static_cast<int>(text.size()));
  google::protobuf::io::Tokenizer tokenizer(&stream, nullptr);
  google::protobuf::FileDescriptorSet set;
  auto* file = set.add_file();
  file->set_name("test.proto");
  EXPECT_TRUE(google::protobuf::compiler::Parser().Parse(&tokenizer, file)) << text;
  return load_protocol(set.SerializeAsString());
}

TEST(Protocol, IsReadFromTheBuild) { EXPECT_GE(ours().files.size(), 4u); }
TEST(Protocol, EverythingIsCommentedWithUnits) { EXPECT_THAT(comment_faults(ours()), IsEmpty()); }
TEST(Protocol, EnumsBeginUnspecified) { EXPECT_THAT(enum_faults(ours()), IsEmpty()); }
TEST(Protocol, EachRpcHasItsOwnMessages) { EXPECT_THAT(rpc_faults(ours()), IsEmpty()); }
TEST(Protocol, NumbersNeverChangeTheirMeaning) {
  EXPECT_THAT(number_faults(ours(), content(OSTEON_NUMBERS)), IsEmpty());
}

TEST(CommentRule, SeesAMissingCommentAndAMissingUnit) {
  EXPECT_THAT(comment_faults(parsed("message M {}\n")), ElementsAre(HasSubstr("M: no comment")));
  EXPECT_THAT(comment_faults(parsed("// A place.\nmessage M {\n  double x_mm = 1;\n}\n")),
              ElementsAre(HasSubstr("M.x_mm: no comment")));
  EXPECT_THAT(comment_faults(parsed("// A place.\nmessage M {\n  double x = 1;  // Where it is.\n}\n")),
              ElementsAre(HasSubstr("names no unit")));
  EXPECT_THAT(comment_faults(parsed("// A place.\nmessage M {\n  double x_mm = 1;  // Where it is; mm.\n}\n")),
              IsEmpty());
}

TEST(CommentRule, AsksEnumsAndRpcsToo) {
  EXPECT_THAT(comment_faults(parsed("// Kinds.\nenum E {\n  E_UNSPECIFIED = 0;\n}\n")),
              ElementsAre(HasSubstr("E_UNSPECIFIED")));
  EXPECT_THAT(comment_faults(parsed("message GoRequest {}\nmessage GoResponse {}\n"
                                    "service S {\n  rpc Go(GoRequest) returns (GoResponse);\n}\n")),
              ElementsAre(HasSubstr("S.Go")));
}

TEST(EnumRule, SeesAMeaningAtZero) {
  EXPECT_THAT(enum_faults(parsed("enum E { E_DRILL = 0; }")), ElementsAre(HasSubstr("_UNSPECIFIED")));
}

TEST(RpcRule, SeesSharedMessages) {
  const auto faults = rpc_faults(
      parsed("message GoRequest {} message GoResponse {} message RunRequest {}"
             "service S { rpc Go(GoRequest) returns (GoResponse); rpc Run(RunRequest) returns (GoResponse); }"));
  EXPECT_THAT(faults, ElementsAre(HasSubstr("should be RunResponse"), HasSubstr("shares GoResponse")));
}

TEST(NumberRule, SeesReuseRetypingRemovalAndAddition) {
  const std::string committed = "M.a = 1 uint64\nM.b = 2 string\n";
  EXPECT_THAT(number_faults(parsed("message M { uint64 a = 1; string b = 2; }"), committed), IsEmpty());
  EXPECT_THAT(number_faults(parsed("message M { uint64 a = 1; string b = 3; }"), committed),
              ElementsAre(HasSubstr("M.b: was")));
  EXPECT_THAT(number_faults(parsed("message M { uint32 a = 1; string b = 2; }"), committed),
              ElementsAre(HasSubstr("M.a: was")));
  EXPECT_THAT(number_faults(parsed("message M { uint64 a = 1; }"), committed),
              ElementsAre(HasSubstr("must be reserved")));
  EXPECT_THAT(number_faults(parsed("message M { reserved 2; uint64 a = 1; }"), committed), IsEmpty());
  EXPECT_THAT(number_faults(parsed("message M { uint64 a = 1; string b = 2; bool c = 3; }"), committed),
              ElementsAre(HasSubstr("not yet in")));
}

}  // namespace
}  // namespace osteon::test
