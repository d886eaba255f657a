//! A door for programmable logic controllers: a Modbus TCP server.
