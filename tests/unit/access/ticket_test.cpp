#include "common/access/ticket.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sodium.h>

#include <set>
#include <string>

namespace osteon {
namespace {

using testing::HasSubstr;
using namespace std::chrono_literals;

constexpr UnixTime kNoon{1'800'000'000s};

// RFC 8032, 7.1, test 1: the key pair of a seed.
constexpr const char* kSeed = "9d61b19deffd5a60ba844af492ec2cc44449c5697b326919703bac031cae7f60";
constexpr const char* kPublic = "d75a980182b10ab7d54bfed3c964073a0ee172f3daa62325af021a68f707511a";

TicketKey key() { return parse_ticket_key(kSeed).value(); }
TicketCheckKey check_key() { return parse_check_key(kPublic).value(); }
Ticket a_ticket() { return make_ticket("anna's room", "ben@ward-3", Role::trainee, kNoon).value(); }

// Any contents, signed as tickets are: what the holder of the key could sign by mistake.
std::string signed_text(const std::string& contents, const std::string& purpose = "osteon join ticket 1\n") {
  std::array<unsigned char, 32> open{};
  std::array<unsigned char, 64> secret{}, signature{};
  const TicketKey k = key();
  crypto_sign_seed_keypair(open.data(), secret.data(), k.seed.data());
  const std::string all = purpose + contents;
  crypto_sign_detached(signature.data(), nullptr, reinterpret_cast<const unsigned char*>(all.data()), all.size(),
                       secret.data());
  const auto base64 = [](const void* bytes, std::size_t size) {
    std::string text(sodium_base64_encoded_len(size, sodium_base64_VARIANT_URLSAFE_NO_PADDING), '\0');
    sodium_bin2base64(text.data(), text.size(), static_cast<const unsigned char*>(bytes), size,
                      sodium_base64_VARIANT_URLSAFE_NO_PADDING);
    text.pop_back();
    return text;
  };
  return "osteon1." + base64(contents.data(), contents.size()) + "." + base64(signature.data(), signature.size());
}

std::string contents(char role, const std::string& room, const std::string& user,
                     std::uint64_t seconds = 1'800'000'000) {
  std::string bytes(16, 'i');
  for (int i = 0; i < 8; ++i) bytes += static_cast<char>(seconds >> (8 * i));
  bytes += role;
  return bytes + static_cast<char>(room.size()) + room + static_cast<char>(user.size()) + user;
}

TEST(TicketKey, IsTheStandardsEd25519) { EXPECT_EQ(to_text(check_key_of(key())), kPublic); }

TEST(TicketKey, IsReadBackAndNothingElseIsRead) {
  const TicketKey fresh = new_ticket_key();
  EXPECT_EQ(parse_ticket_key("  " + to_text(fresh) + "\n")->seed, fresh.seed);
  EXPECT_NE(new_ticket_key().seed, fresh.seed);
  const std::string text = to_text(fresh);
  for (const std::string& wrong : {std::string(), text.substr(1), text + "0", "g" + text.substr(1)}) {
    ASSERT_FALSE(parse_ticket_key(wrong));
    EXPECT_THAT(parse_ticket_key(wrong).error().message, HasSubstr("deploy/certs"));
    if (!wrong.empty()) {
      EXPECT_THAT(parse_ticket_key(wrong).error().message, testing::Not(HasSubstr(wrong)));
    }
    EXPECT_FALSE(parse_check_key(wrong));
  }
}

TEST(TicketKey, OfSeveralStandsOneOnALine) {
  const TicketCheckKey first = check_key_of(new_ticket_key()), second = check_key_of(new_ticket_key());
  const auto keys = parse_check_keys(to_text(first) + "\n\n  " + to_text(second) + "\r\n");
  ASSERT_TRUE(keys.has_value()) << keys.error().message;
  EXPECT_EQ(*keys, (std::vector{first, second}));
  EXPECT_EQ(parse_check_keys(to_text(first)).value(), std::vector{first});
  EXPECT_THAT(parse_check_keys(to_text(first) + "\nhalf a key\n").error().message, HasSubstr("line 2: "));
  EXPECT_THAT(parse_check_keys("\n\n").error().message, HasSubstr("it has 0 keys"));
  std::string five;
  for (int i = 0; i < 5; ++i) five += to_text(first) + "\n";
  EXPECT_THAT(parse_check_keys(five).error().message, HasSubstr("it has 5 keys"));
}

TEST(Ticket, ComesBackAsItWasSigned) {
  for (const Role role : {Role::observer, Role::trainee, Role::collaborator, Role::instructor, Role::operator_}) {
    const Ticket ticket = make_ticket(std::string(kAnyRoom), "u", role, kNoon).value();
    const std::string text = sign_ticket(ticket, key());
    EXPECT_LE(text.size(), kMostTicketChars);
    EXPECT_EQ(text.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_."),
              std::string::npos);
    const Result<Ticket> back = open_ticket(text, check_key());
    ASSERT_TRUE(back.has_value()) << back.error().message;
    EXPECT_EQ(*back, ticket);
  }
  const Ticket longest = make_ticket(std::string(255, 'r'), std::string(64, 'u'), Role::observer, kNoon).value();
  const Result<Ticket> back = open_ticket(sign_ticket(longest, key()), check_key());
  ASSERT_TRUE(back.has_value());
  EXPECT_EQ(*back, longest);
}

TEST(Ticket, HasAnIdOfItsOwn) {
  std::set<std::string> ids;
  for (int i = 0; i < 100; ++i) EXPECT_TRUE(ids.insert(to_hex(a_ticket().id)).second);
}

TEST(Ticket, IsOpenedAsTheFormatSays) {
  const Result<Ticket> ticket = open_ticket(signed_text(contents(3, "ward", "eve")), check_key());
  ASSERT_TRUE(ticket.has_value()) << ticket.error().message;
  EXPECT_EQ(ticket->room, "ward");
  EXPECT_EQ(ticket->user, "eve");
  EXPECT_EQ(ticket->role, Role::collaborator);
  EXPECT_EQ(ticket->expires, kNoon);
}

TEST(Ticket, IsRefusedAfterAnyChangeOfABit) {
  const std::string text = sign_ticket(a_ticket(), key());
  for (std::size_t i = 0; i < text.size(); ++i)
    for (int bit = 0; bit < 8; ++bit) {
      std::string changed = text;
      changed[i] = static_cast<char>(changed[i] ^ (1 << bit));
      EXPECT_FALSE(open_ticket(changed, check_key())) << "character " << i << ", bit " << bit;
    }
}

// Whoever compares texts of tickets must not be shown one ticket in two of them. The base64 library reads some bytes
// that are not base64 as if they were.
TEST(Ticket, HasOneText) {
  std::string of_all_digits;  // its base64 has each of the 64 digits
  for (unsigned digit = 0; digit < 64; digit += 4) {
    const unsigned group = digit << 18 | (digit + 1) << 12 | (digit + 2) << 6 | (digit + 3);
    for (const int shift : {16, 8, 0}) of_all_digits += static_cast<char>(group >> shift & 0xff);
  }
  const std::string body = contents(3, "ward", "eve");
  // The id has 16 bytes, so three tickets have all the digits.
  for (std::size_t part = 0; part < of_all_digits.size(); part += 16) {
    const std::string text = signed_text(of_all_digits.substr(part, 16) + body.substr(16));
    ASSERT_TRUE(open_ticket(text, check_key()));
    for (std::size_t i = 0; i < text.size(); ++i)
      for (int byte = 0x80; byte <= 0xff; ++byte) {
        std::string changed = text;
        changed[i] = static_cast<char>(byte);
        EXPECT_FALSE(open_ticket(changed, check_key())) << "character " << i << " as " << byte;
      }
  }
}

TEST(Ticket, IsRefusedWhenCutOrLengthened) {
  const std::string text = sign_ticket(a_ticket(), key());
  for (std::size_t size = 0; size < text.size(); ++size)
    EXPECT_FALSE(open_ticket(text.substr(0, size), check_key())) << size;
  for (const char* more : {"A", "=", ".", " ", "\n"}) EXPECT_FALSE(open_ticket(text + more, check_key()));
  EXPECT_FALSE(open_ticket(text + std::string(5000, 'A'), check_key()));
  EXPECT_FALSE(open_ticket(" " + text, check_key()));
}

TEST(Ticket, IsRefusedWithAnotherKeysSignature) {
  const TicketKey forger = new_ticket_key();
  const Result<Ticket> forged = open_ticket(sign_ticket(a_ticket(), forger), check_key());
  ASSERT_FALSE(forged);
  EXPECT_EQ(forged.error().code, ErrorCode::invalid_input);
  EXPECT_THAT(forged.error().message, HasSubstr("signature"));
  // The signature of one ticket on the contents of another.
  const std::string mine = sign_ticket(a_ticket(), key()),
                    better = sign_ticket(make_ticket("r", "u", Role::instructor, kNoon).value(), forger);
  const std::string mixed = better.substr(0, better.rfind('.')) + mine.substr(mine.rfind('.'));
  ASSERT_FALSE(open_ticket(mixed, check_key()));
}

TEST(Ticket, IsNoOtherThingThatTheKeySigned) {
  EXPECT_TRUE(open_ticket(signed_text(contents(2, "r", "u")), check_key()));
  EXPECT_FALSE(open_ticket(signed_text(contents(2, "r", "u"), ""), check_key()));
  EXPECT_FALSE(open_ticket(signed_text(contents(2, "r", "u"), "osteon join ticket 2\n"), check_key()));
}

TEST(Ticket, IsRefusedWhenItsSignedContentsMakeNoSense) {
  const auto malformed = [](const std::string& bytes) {
    const Result<Ticket> ticket = open_ticket(signed_text(bytes), check_key());
    return !ticket && ticket.error().message.find("malformed") != std::string::npos;
  };
  EXPECT_TRUE(malformed(""));
  EXPECT_TRUE(malformed(contents(0, "r", "u")));
  EXPECT_TRUE(malformed(contents(6, "r", "u")));
  EXPECT_TRUE(malformed(contents(1, "", "u")));
  EXPECT_TRUE(malformed(contents(1, "r", "")));
  EXPECT_TRUE(malformed(contents(1, "r", "a b")));
  EXPECT_TRUE(malformed(contents(1, "r\n", "u")));
  EXPECT_TRUE(malformed(contents(1, "r", "u") + "x"));
  EXPECT_TRUE(malformed(contents(1, "r", "u", ~0ull)));
  const std::string whole = contents(1, "room", "user");
  for (std::size_t size = 0; size < whole.size(); ++size) EXPECT_TRUE(malformed(whole.substr(0, size))) << size;
}

TEST(Ticket, SaysWhatIsWrongInOneSentence) {
  for (const char* text : {"", "nonsense", "osteon1.", "osteon1.AAAA", "osteon1.AAAA.AAAA", "osteon2.AAAA.AAAA",
                           "osteon1.aAeon1.", "osteon1..AAAA", "osteon1.."}) {
    const Result<Ticket> ticket = open_ticket(text, check_key());
    ASSERT_FALSE(ticket);
    EXPECT_EQ(ticket.error().code, ErrorCode::invalid_input);
    EXPECT_THAT(ticket.error().message, HasSubstr("malformed"));
  }
}

TEST(Ticket, EndsWithTheSecondItNames) {
  const Ticket ticket = a_ticket();
  EXPECT_TRUE(check_time(ticket, kNoon - 1s));
  const Result<void> late = check_time(ticket, kNoon);
  ASSERT_FALSE(late);
  EXPECT_EQ(late.error().code, ErrorCode::unavailable);
  EXPECT_THAT(late.error().message, HasSubstr("expired at 2027-01-15 08:00:00 UTC"));
}

TEST(Ticket, IsForItsRoom) {
  EXPECT_TRUE(check_room(a_ticket(), "anna's room"));
  for (const char* room : {"anna", "", "Anna's room", "*"}) {
    ASSERT_FALSE(check_room(a_ticket(), room)) << room;
    EXPECT_EQ(check_room(a_ticket(), room).error().code, ErrorCode::unsupported);
  }
  EXPECT_TRUE(check_room(make_ticket("*", "u", Role::operator_, kNoon).value(), "anything"));
}

TEST(Ticket, IsNotMadeOfNonsense) {
  EXPECT_FALSE(make_ticket("", "u", Role::observer, kNoon));
  EXPECT_FALSE(make_ticket(std::string(256, 'r'), "u", Role::observer, kNoon));
  EXPECT_FALSE(make_ticket("r", "", Role::observer, kNoon));
  EXPECT_FALSE(make_ticket("r", "a/b", Role::observer, kNoon));
  EXPECT_FALSE(make_ticket("r", std::string(65, 'u'), Role::observer, kNoon));
  EXPECT_FALSE(make_ticket("r", "u", Role::none, kNoon));
}

}  // namespace
}  // namespace osteon
