// What a client of the previous version receives, and what a client of an unknown version receives.
#include <gtest/gtest.h>

#include <set>
#include <string>

#include "common/wire/version.hpp"

namespace osteon::wire {
namespace {

TEST(Version, TheServerTakesItsOwnAndTheOneBefore) {
  EXPECT_EQ(kProtocolVersion, 4u);
  for (const std::uint32_t taken : {3u, 4u}) EXPECT_TRUE(check_protocol_version(taken).has_value()) << taken;
  for (const std::uint32_t other : {0u, 2u, 5u, 77u}) {
    const Result<void> checked = check_protocol_version(other);
    ASSERT_FALSE(checked.has_value()) << other;
    EXPECT_EQ(checked.error().code, ErrorCode::unsupported);
    const std::string& why = checked.error().message;
    EXPECT_NE(why.find("version " + std::to_string(other) + " "), std::string::npos) << why;
    EXPECT_NE(why.find("version 4, or 3"), std::string::npos) << why;
    EXPECT_NE(why.find("install a newer Osteon where the " + std::string(other < 3 ? "client" : "server") + " runs"),
              std::string::npos)
        << why;
    EXPECT_EQ(why.find('\n'), std::string::npos);
  }
}

// Every kind of message, as the protocol's descriptor lists them. Version 3 knows the kinds up to number 10.
TEST(Version, KnowsWhichKindsOfMessagesAreNew) {
  const auto* kinds = v1::SessionResponse::descriptor()->FindOneofByName("message");
  ASSERT_NE(kinds, nullptr);
  std::set<std::string> newer;
  for (int i = 0; i < kinds->field_count(); ++i) {
    const auto* field = kinds->field(i);
    v1::SessionResponse entry;
    (void)entry.GetReflection()->MutableMessage(&entry, field);
    ASSERT_EQ(static_cast<int>(entry.message_case()), field->number());
    EXPECT_EQ(version_of(entry.message_case()), field->number() <= 10 ? 3u : 4u) << field->name();
    if (field->number() > 10) newer.insert(field->name());
  }
  EXPECT_EQ(newer, (std::set<std::string>{"supervised", "chat", "partner", "bone", "redial"}));
}

}  // namespace
}  // namespace osteon::wire
