#include "common/wire/tls_probe.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netdb.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <future>
#include <memory>
#include <string_view>
#include <system_error>
#include <thread>

namespace osteon::wire {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr std::size_t kFirstBytes = 16;
constexpr auto kStopPeriod = 50ms;  // between two looks whether the caller has stopped

using Stop = std::function<bool()>;
bool has_stopped(const Stop& stop) { return stop && stop(); }

struct Address {
  int family = 0;
  sockaddr_storage at{};
  socklen_t size = 0;
};
struct Addresses {
  std::vector<Address> all;
  std::string why;  // why there is no address
};

Addresses look_up(const std::string& host, const std::string& port) {
  addrinfo hints{}, *found = nullptr;
  hints.ai_socktype = SOCK_STREAM;
  if (const int unknown = ::getaddrinfo(host.c_str(), port.c_str(), &hints, &found); unknown != 0)
    return {{}, ::gai_strerror(unknown)};
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> freed(found, ::freeaddrinfo);
  Addresses addresses;
  for (const addrinfo* one = found; one; one = one->ai_next) {
    Address& address = addresses.all.emplace_back();
    address.family = one->ai_family;
    address.size = one->ai_addrlen;
    std::copy_n(reinterpret_cast<const char*>(one->ai_addr), one->ai_addrlen, reinterpret_cast<char*>(&address.at));
  }
  return addresses;
}

// The system's resolver has no timeout. After `until`, or a stop, its thread is left to end by itself.
Addresses look_up_until(const std::string& host, const std::string& port, Clock::time_point until, const Stop& stop) {
  std::packaged_task<Addresses()> task([host, port] { return look_up(host, port); });
  std::future<Addresses> found = task.get_future();
  std::thread(std::move(task)).detach();
  while (found.wait_until(std::min(until, Clock::now() + kStopPeriod)) != std::future_status::ready)
    if (Clock::now() >= until || has_stopped(stop)) return {{}, "the name service does not answer"};
  return found.get();
}

int milliseconds_until(Clock::time_point until) {
  return static_cast<int>(
      std::max<std::int64_t>(0, std::chrono::ceil<std::chrono::milliseconds>(until - Clock::now()).count()));
}

class Socket {
 public:
  explicit Socket(const Stop& stop) : stop_(stop) {}
  ~Socket() { close(); }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;

  // 0, or the system's error number.
  int connect(const Address& to, Clock::time_point until) {
    close();
    descriptor_ = ::socket(to.family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (descriptor_ < 0) return errno;
    if (::connect(descriptor_, reinterpret_cast<const sockaddr*>(&to.at), to.size) == 0) return 0;
    if (errno != EINPROGRESS) return errno;
    if (!ready(POLLOUT, until)) return ETIMEDOUT;
    int error = 0;
    socklen_t size = sizeof error;
    return ::getsockopt(descriptor_, SOL_SOCKET, SO_ERROR, &error, &size) == 0 ? error : errno;
  }
  // False: the other end has closed it, or accepts nothing.
  bool send(std::string_view bytes, Clock::time_point until) {
    while (!bytes.empty()) {
      const ssize_t sent = ::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent > 0)
        bytes.remove_prefix(static_cast<std::size_t>(sent));
      else if ((errno != EAGAIN && errno != EWOULDBLOCK) || !ready(POLLOUT, until))
        return false;
    }
    return true;
  }
  // Number of bytes received. 0: the other end has closed it. -1: nothing arrived in time.
  int receive(char* into, std::size_t most, Clock::time_point until) {
    if (!ready(POLLIN, until)) return -1;
    return static_cast<int>(std::max<ssize_t>(0, ::recv(descriptor_, into, most, 0)));
  }

 private:
  bool ready(short what, Clock::time_point until) {
    pollfd one{descriptor_, what, 0};
    while (::poll(&one, 1, milliseconds_until(std::min(until, Clock::now() + kStopPeriod))) <= 0)
      if (Clock::now() >= until || has_stopped(stop_)) return false;
    return true;
  }
  void close() {
    if (descriptor_ >= 0) ::close(descriptor_);
    descriptor_ = -1;
  }
  const Stop& stop_;
  int descriptor_ = -1;
};

// Reports the system's error for the address that got furthest. A refusal says more than silence.
bool connect(Socket& socket, const std::vector<Address>& addresses, Clock::time_point until, Probe& probe) {
  for (std::size_t i = 0; i < addresses.size(); ++i) {
    // The remaining addresses share the remaining time equally.
    const auto share = (until - Clock::now()) / static_cast<int>(addresses.size() - i);
    const int error = socket.connect(addresses[i], Clock::now() + share);
    if (error == 0) return true;
    if (probe.is_refused) continue;
    probe.is_refused = error == ECONNREFUSED;
    probe.is_silent = error == ETIMEDOUT;
    probe.system = std::generic_category().message(error);
  }
  return false;
}

// Stores what is wrong with the server's certificate and ends the handshake, so that an impostor sees nothing of ours.
int judge_certificate(int holds, X509_STORE_CTX* context) {
  auto* ssl = static_cast<SSL*>(X509_STORE_CTX_get_ex_data(context, SSL_get_ex_data_X509_STORE_CTX_idx()));
  auto& probe = *static_cast<Probe*>(SSL_get_app_data(ssl));
  X509* own = X509_STORE_CTX_get0_cert(context);
  if (!probe.shown && own && X509_up_ref(own) == 1) probe.shown.reset(own);
  if (holds == 1) return 1;
  probe.verify_error = X509_STORE_CTX_get_error(context);
  probe.verify_depth = X509_STORE_CTX_get_error_depth(context);
  return 0;
}

// TLS over memory. So a write to a closed connection does not end the process, and the first bytes can be inspected.
class Tls {
 public:
  Tls(Socket& socket, Clock::time_point until, Probe& probe) : socket_(socket), until_(until), probe_(probe) {}

  bool set_up(const std::string& host, const ProbeFiles& files) {
    SSL_CTX* context = context_.get();
    static constexpr unsigned char kHttp2[] = {2, 'h', '2'};
    if (!context || SSL_CTX_set_alpn_protos(context, kHttp2, sizeof kHttp2) != 0) return false;
    if (!files.authority.empty()) {
      for (const X509Ptr& one : certificates_of(files.authority))
        X509_STORE_add_cert(SSL_CTX_get_cert_store(context), one.get());
      SSL_CTX_set_verify(context, SSL_VERIFY_PEER, judge_certificate);
    }
    const std::vector<X509Ptr> chain = certificates_of(files.certificate);
    const KeyPtr key = key_of(files.key);
    if (!chain.empty() && key) {
      if (SSL_CTX_use_certificate(context, chain.front().get()) != 1) return false;
      for (std::size_t i = 1; i < chain.size(); ++i) SSL_CTX_add1_chain_cert(context, chain[i].get());
      if (SSL_CTX_use_PrivateKey(context, key.get()) != 1) return false;
    }
    ssl_.reset(SSL_new(context));
    if (!ssl_) return false;
    in_ = BIO_new(BIO_s_mem());
    out_ = BIO_new(BIO_s_mem());
    SSL_set_bio(ssl_.get(), in_, out_);  // takes ownership of both
    SSL_set_app_data(ssl_.get(), &probe_);
    X509_VERIFY_PARAM* rules = SSL_get0_param(ssl_.get());
    if (X509_VERIFY_PARAM_set1_ip_asc(rules, host.c_str()) == 1) return true;
    (void)SSL_set_tlsext_host_name(ssl_.get(), host.c_str());
    return SSL_set1_host(ssl_.get(), host.c_str()) == 1;
  }

  void shake_hands() {
    if (!go_on([&] { return SSL_connect(ssl_.get()); })) return;
    probe_.is_agreed = true;
    const unsigned char* agreed = nullptr;
    unsigned size = 0;
    SSL_get0_alpn_selected(ssl_.get(), &agreed, &size);
    probe_.protocol.assign(reinterpret_cast<const char*>(agreed), size);
  }

  // Sends the beginning of HTTP/2 (RFC 9113, section 3.4) and reads the answer. In TLS 1.3 a client learns only then
  // that its certificate is refused.
  void greet() {
    static constexpr std::string_view kPreface("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\4\0\0\0\0\0", 33);
    char some[64];
    if (!go_on([&] { return SSL_write(ssl_.get(), kPreface.data(), static_cast<int>(kPreface.size())); })) return;
    if (go_on([&] { return SSL_read(ssl_.get(), some, sizeof some); })) probe_.reached = Probe::Reached::server;
  }

 private:
  template <class Step>
  bool go_on(Step step) {
    char some[4096];
    while (true) {
      ERR_clear_error();
      const int done = step();
      flush();
      if (done > 0) return true;
      if (SSL_get_error(ssl_.get(), done) != SSL_ERROR_WANT_READ) break;
      const int got = socket_.receive(some, sizeof some, until_);
      probe_.is_silent = got < 0;
      probe_.is_closed = got == 0;
      if (got <= 0) return false;
      probe_.first_bytes.append(some, std::min(kFirstBytes - probe_.first_bytes.size(), static_cast<std::size_t>(got)));
      BIO_write(in_, some, got);
    }
    const int reason = ERR_GET_REASON(ERR_peek_error());
    if (reason >= SSL_AD_REASON_OFFSET && reason < SSL_AD_REASON_OFFSET + 256)
      probe_.alert = reason - SSL_AD_REASON_OFFSET;
    else if (SSL_get_shutdown(ssl_.get()) & SSL_RECEIVED_SHUTDOWN)
      probe_.is_closed = true;
    ERR_clear_error();
    return false;
  }
  void flush() {
    char some[4096];
    for (int size = 0; (size = BIO_read(out_, some, sizeof some)) > 0;)
      (void)socket_.send({some, static_cast<std::size_t>(size)}, until_);
  }

  Socket& socket_;
  const Clock::time_point until_;
  Probe& probe_;
  std::unique_ptr<SSL_CTX, void (*)(SSL_CTX*)> context_{SSL_CTX_new(TLS_client_method()), SSL_CTX_free};
  std::unique_ptr<SSL, void (*)(SSL*)> ssl_{nullptr, SSL_free};
  BIO *in_ = nullptr, *out_ = nullptr;
};

}  // namespace

Probe probe_tls(const std::string& host, const std::string& port, const ProbeFiles& files,
                std::chrono::milliseconds patience, const Stop& stop) {
  Probe probe;
  const auto until = Clock::now() + patience;
  const Addresses addresses = look_up_until(host, port, until, stop);
  probe.system = addresses.why;
  if (addresses.all.empty()) return probe;
  probe.reached = Probe::Reached::name;
  Socket socket(stop);
  if (!connect(socket, addresses.all, until, probe)) return probe;
  probe = {};
  probe.reached = Probe::Reached::machine;
  Tls tls(socket, until, probe);
  if (!tls.set_up(host, files)) return probe;
  tls.shake_hands();
  constexpr char kHandshake = 22, kAlert = 21;  // TLS record types, before the version 3.x (RFC 8446, section 5.1)
  const std::string& first = probe.first_bytes;
  if (first.size() > 1 && (first[0] == kHandshake || first[0] == kAlert) && first[1] == 3) {
    probe.reached = Probe::Reached::tls;
    if (probe.is_agreed) tls.greet();
  }
  return probe;
}

}  // namespace osteon::wire
