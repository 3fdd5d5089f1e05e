    {
        const double beta = fabs(s->beta_per_s);
        const double omega = fabs(s->omega_per_s);
        const double speed = (beta * beta) + (omega * omega);
        const double e = ((s->alpha * beta) / speed) * per_scale;
        const double h = ((s->alpha * omega) / speed) * per_scale;
        p->quadrature = @quadrature@;
        p->in_phase = @in_phase@;
        p->rho = beta / omega;
    }
