// Asio and Beast compiled once (BOOST_ASIO_SEPARATE_COMPILATION), so that the files which use them compile fast.
#include <boost/asio/impl/src.hpp>
#include <boost/asio/ssl/impl/src.hpp>
#include <boost/beast/src.hpp>
