#include "tests/support/authentication/raw_http2.hpp"

#include <arpa/inet.h>
#include <linux/filter.h>
#include <netinet/in.h>
#include <openssl/ssl.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <csignal>
#include <stdexcept>

namespace osteon::test {
namespace {

constexpr std::uint8_t kHeaders = 1, kReset = 3, kEndHeaders = 0x4;

std::string frame(std::uint8_t type, std::uint8_t flags, std::uint32_t stream, const std::string& payload) {
  const auto byte = [](std::size_t value, int shift) { return static_cast<char>(value >> shift & 0xff); };
  std::string all{byte(payload.size(), 16), byte(payload.size(), 8),  byte(payload.size(), 0),
                  static_cast<char>(type),  static_cast<char>(flags), byte(stream, 24),
                  byte(stream, 16),         byte(stream, 8),          byte(stream, 0)};
  return all + payload;
}

// A length with a prefix of 7 bits (RFC 7541, section 5.1), then the text without Huffman coding.
std::string literal(const std::string& text) {
  std::string out;
  std::size_t left = text.size();
  if (left < 127) {
    out += static_cast<char>(left);
  } else {
    out += static_cast<char>(127);
    for (left -= 127; left >= 128; left /= 128) out += static_cast<char>(left % 128 + 128);
    out += static_cast<char>(left);
  }
  return out + text;
}

}  // namespace

struct RawHttp2::Tls {
  std::unique_ptr<SSL_CTX, void (*)(SSL_CTX*)> context{SSL_CTX_new(TLS_client_method()), SSL_CTX_free};
  std::unique_ptr<SSL, void (*)(SSL*)> ssl{nullptr, SSL_free};
  int socket = -1;
  std::string arrived;
  bool closed = false;

  ~Tls() {
    ssl.reset();
    if (socket >= 0) ::close(socket);
  }
  // Waits for data and reads it. False: nothing arrived.
  bool take_in(std::chrono::milliseconds patience) {
    if (closed) return false;
    if (SSL_pending(ssl.get()) == 0) {
      pollfd ready{socket, POLLIN, 0};
      if (::poll(&ready, 1, static_cast<int>(patience.count())) <= 0) return false;
    }
    char some[16384];
    const int got = SSL_read(ssl.get(), some, sizeof some);
    if (got <= 0) {
      closed = true;
      return false;
    }
    arrived.append(some, static_cast<std::size_t>(got));
    return true;
  }
};

RawHttp2::RawHttp2(const std::string& address, const std::filesystem::path& person) : tls_(std::make_unique<Tls>()) {
  // If the server has closed the connection, the writing call fails; the test must not end.
  static const auto ignored = ::signal(SIGPIPE, SIG_IGN);
  (void)ignored;
  SSL_CTX* context = tls_->context.get();
  SSL_CTX_set_security_level(context, 0);  // a client with a weak key does not check this
  static constexpr unsigned char kAlpn[] = {2, 'h', '2'};
  SSL_CTX_set_alpn_protos(context, kAlpn, sizeof kAlpn);
  if (!person.empty() && (SSL_CTX_use_certificate_chain_file(context, (person / "person.pem").c_str()) != 1 ||
                          SSL_CTX_use_PrivateKey_file(context, (person / "person.key").c_str(), SSL_FILETYPE_PEM) != 1))
    throw std::runtime_error("no certificate in " + person.string());
  const std::size_t colon = address.rfind(':');
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(colon + 1))));
  if (::inet_pton(AF_INET, address.substr(0, colon).c_str(), &at.sin_addr) != 1)
    throw std::runtime_error("no IPv4 address");
  tls_->socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  // A handshake that the server does not continue must end by itself.
  const timeval patience{.tv_sec = 10, .tv_usec = 0};
  ::setsockopt(tls_->socket, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  if (::connect(tls_->socket, reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0)
    throw std::runtime_error("nobody listens");
  tls_->ssl.reset(SSL_new(context));
  SSL_set_fd(tls_->ssl.get(), tls_->socket);
  tls_->closed = SSL_connect(tls_->ssl.get()) != 1;
  send("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + frame(4, 0, 0, ""));
}

RawHttp2::~RawHttp2() = default;

bool RawHttp2::send(const std::string& bytes) {
  if (tls_->closed) return false;
  if (SSL_write(tls_->ssl.get(), bytes.data(), static_cast<int>(bytes.size())) > 0) return true;
  tls_->closed = true;
  return false;
}

bool RawHttp2::call(std::uint32_t stream, const std::string& path, const Headers& more) {
  Headers all{{":method", "POST"},   {":scheme", "https"}, {":path", path},
              {":authority", "raw"}, {"te", "trailers"},   {"content-type", "application/grpc"}};
  all.insert(all.end(), more.begin(), more.end());
  std::string block;
  // Literal fields that are not indexed, with names of their own (RFC 7541, section 6.2.2).
  for (const auto& [name, value] : all) block += std::string(1, '\0') + literal(name) + literal(value);
  return send(frame(kHeaders, kEndHeaders, stream, block));
}

bool RawHttp2::send_message(std::uint32_t stream, const std::string& bytes) {
  constexpr std::uint8_t kData = 0, kEndStream = 0x1;
  // No compression, then the length in four bytes.
  const std::string head{'\0', '\0', '\0', static_cast<char>(bytes.size() >> 8), static_cast<char>(bytes.size())};
  return send(frame(kData, kEndStream, stream, head + bytes));
}

bool RawHttp2::reset(std::uint32_t stream) {
  constexpr char kCancel = 8;
  return send(frame(kReset, 0, stream, std::string(3, '\0') + kCancel));
}

std::optional<Http2Frame> RawHttp2::read(std::chrono::milliseconds patience) {
  constexpr std::size_t kHead = 9;
  const auto byte = [&](std::size_t i) {
    return static_cast<std::size_t>(static_cast<unsigned char>(tls_->arrived[i]));
  };
  const auto size = [&] { return byte(0) << 16 | byte(1) << 8 | byte(2); };
  while (tls_->arrived.size() < kHead || tls_->arrived.size() < kHead + size())
    if (!tls_->take_in(patience)) return {};
  const std::size_t stream = byte(5) << 24 | byte(6) << 16 | byte(7) << 8 | byte(8);
  Http2Frame next{static_cast<std::uint8_t>(byte(3)), static_cast<std::uint32_t>(stream),
                  tls_->arrived.substr(kHead, size())};
  tls_->arrived.erase(0, kHead + size());
  return next;
}

void RawHttp2::go_deaf() {
  sock_filter drop_all{.code = BPF_RET | BPF_K, .jt = 0, .jf = 0, .k = 0};
  const sock_fprog program{.len = 1, .filter = &drop_all};
  if (::setsockopt(tls_->socket, SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof program) != 0)
    throw std::runtime_error("the system attaches no filter");
}

bool RawHttp2::closed_within(std::chrono::milliseconds patience) {
  const auto until = std::chrono::steady_clock::now() + patience;
  while (!tls_->closed && std::chrono::steady_clock::now() < until) (void)read(std::chrono::milliseconds(100));
  return tls_->closed;
}

}  // namespace osteon::test
