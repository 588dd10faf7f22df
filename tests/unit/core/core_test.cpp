#include <gtest/gtest.h>

#include "common/core/bounded_text.hpp"
#include "common/core/check.hpp"
#include "common/core/digest.hpp"
#include "common/core/id.hpp"
#include "common/core/units.hpp"

namespace osteon {
namespace {

std::string sha256(std::string_view text) {
  Hasher hasher;
  hasher.bytes(std::as_bytes(std::span(text)));
  return to_hex(hasher.finish());
}

// FIPS 180-2, appendix B.
TEST(Digest, IsSha256) {
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

TEST(Digest, ComesBackFromHexadecimal) {
  const std::string hex = sha256("bone");
  ASSERT_TRUE(digest_from_hex(hex));
  EXPECT_EQ(to_hex(*digest_from_hex(hex)), hex);
  EXPECT_FALSE(digest_from_hex(hex.substr(1)));
  EXPECT_FALSE(digest_from_hex("x" + hex.substr(1)));
}

TEST(Digest, TextsDoNotRunIntoEachOther) {
  const auto of = [](std::string_view a, std::string_view b) {
    Hasher hasher;
    hasher.text(a);
    hasher.text(b);
    return hasher.finish();
  };
  EXPECT_NE(of("ab", "c"), of("a", "bc"));
}

TEST(Id, IsNullWhenZero) {
  EXPECT_FALSE(AuthorId{});
  EXPECT_TRUE(AuthorId{3});
  EXPECT_LT(AuthorId{3}, AuthorId{4});
}

TEST(Units, AddAndCompareWithinTheirKind) {
  EXPECT_EQ(Millimetres{1.5} + Millimetres{0.5}, Millimetres{2.0});
  EXPECT_LT(Newtons{1.0}, Newtons{2.0});
  static_assert(!std::is_convertible_v<double, Newtons> && !std::is_convertible_v<Millimetres, Newtons>);
}

TEST(CheckDeathTest, SaysWhichPromiseWasBroken) {
  EXPECT_DEATH(OSTEON_CHECK(1 + 1 == 3), "broken promise: 1 \\+ 1 == 3");
}

TEST(WithoutPaths, LeavesTheLastNames) {
  EXPECT_EQ(without_paths("cannot write /srv/rooms/anna.journal: no space"), "cannot write anna.journal: no space");
  EXPECT_EQ(without_paths("(rooms/a.journal), \"/x/y z/b/\"; c"), "(a.journal), \"y b\"; c");
  EXPECT_EQ(without_paths("cannot rename /x/sound.partial-4711 to /x/sound"), "cannot rename sound to sound");
  EXPECT_EQ(without_paths("/"), "");
  EXPECT_EQ(without_paths("a room"), "a room");
  EXPECT_EQ(without_paths("cannot sync /x/a: Input/output error"), "cannot sync a: Input/output error");
  EXPECT_EQ(without_paths("/x/a: disk I/O error"), "a: disk I/O error");
}

TEST(BoundedText, IsOneLineOfSoManyBytes) {
  EXPECT_EQ(bounded_text("a bone, ä"), "a bone, ä");
  EXPECT_EQ(bounded_text("a\nb\x1b[2J\x7f\t\xc2\x9b"), "a b [2J    ");
  EXPECT_EQ(bounded_text(std::string(5000, 'x')).size(), kMostErrorBytes + 4);
  EXPECT_EQ(bounded_text("abcdef", 3), "abc ...");
  EXPECT_EQ(bounded_text("abä", 3), "ab ...") << "a character must not be split";
}

// Unicode 15, table 3-7: well-formed UTF-8 byte sequences.
TEST(BoundedText, IsUtf8) {
  // The first and the last character of each length, and those around the UTF-16 pairs.
  for (const std::string good : {"\xc2\xa0", "\xdf\xbf", "\xe0\xa0\x80", "\xed\x9f\xbf", "\xee\x80\x80", "\xef\xbf\xbf",
                                 "\xf0\x90\x80\x80", "\xf4\x8f\xbf\xbf"}) {
    EXPECT_EQ(bounded_text("a" + good + "b"), "a" + good + "b");
    for (std::size_t part = 1; part < good.size(); ++part) {
      EXPECT_EQ(bounded_text("a" + good, part + 1), "a ...") << "split behind byte " << part;
      EXPECT_EQ(bounded_text(good.substr(0, part)), std::string(part, '?')) << "cut behind byte " << part;
      EXPECT_EQ(bounded_text(good.substr(0, part) + "b"), std::string(part, '?') + "b");
    }
    EXPECT_EQ(bounded_text(good, good.size()), good);
  }
  // Single bytes, forms longer than needed, half of a UTF-16 pair, beyond U+10FFFF, and of five bytes.
  for (const std::string wrong :
       {"\x80", "\xbf", "\xc0\x80", "\xc1\xbf", "\xe0\x9f\xbf", "\xed\xa0\x80", "\xed\xbf\xbf", "\xf0\x8f\xbf\xbf",
        "\xf4\x90\x80\x80", "\xf5\x80\x80\x80", "\xf8\x88\x80\x80\x80", "\xff"})
    EXPECT_EQ(bounded_text("a" + wrong + "ä"), "a" + std::string(wrong.size(), '?') + "ä");
  EXPECT_EQ(bounded_text("\xe4"), "?") << "ä of Latin 1 at the end";
  EXPECT_EQ(bounded_text(std::string(9, '\x80'), 4), "???? ...");
}

}  // namespace
}  // namespace osteon
